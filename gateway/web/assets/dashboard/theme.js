"use strict";

// Runs before the first paint, and is therefore no module: the chosen theme, else the system's.
{
  const KEPT = "springscale-theme";
  const CHOICES = ["system", "light", "dark"];
  const root = document.documentElement;
  const chosen = () => (CHOICES.includes(localStorage.getItem(KEPT)) ? localStorage.getItem(KEPT) : "system");
  const apply = () => {
    if (chosen() === "system") delete root.dataset.theme;
    else root.dataset.theme = chosen();
  };
  const tell = () => document.dispatchEvent(new Event("themechange"));
  const choose = (choice) => {
    localStorage.setItem(KEPT, choice);
    apply();
    tell();
  };

  apply();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", tell);
  globalThis.springscaleTheme = { CHOICES, chosen, choose };
}
