"use strict";

// Before the first paint, and therefore no module: the chosen theme, else the system's.
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

  apply();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", tell);
  document.addEventListener("DOMContentLoaded", () => {
    const button = document.getElementById("theme");
    const name = () => { 
      button.lastElementChild.textContent = ` ${chosen()}`;
      button.setAttribute("aria-label", `Theme: ${chosen()}`);
    };
    name();
    button.addEventListener("click", () => {
      localStorage.setItem(KEPT, CHOICES[(CHOICES.indexOf(chosen()) + 1) % CHOICES.length]);
      apply();
      name();
      tell();
    });
  });
}
