// On a phone the less important cards are folded to their titles; a wider page shows them whole.

const isPhone = matchMedia("(max-width: 40rem)");

/** Charts in a folded card wait until there is room for them. */
function toggle(card, isFolded) {
  card.classList.toggle("folded", isFolded);
  card.querySelector(".fold")?.setAttribute("aria-expanded", String(!isFolded));
  if (!isFolded) card.dispatchEvent(new Event("unfold", { bubbles: true }));
}

function button(card) {
  const built = document.createElement("button");
  built.type = "button";
  built.className = "fold";
  built.addEventListener("click", () => toggle(card, !card.classList.contains("folded")));
  return built;
}

function fit() {
  for (const card of document.querySelectorAll("[data-folds]")) {
    const title = card.querySelector("h2"), text = title.textContent;
    if (isPhone.matches) {
      title.replaceChildren(button(card));
      title.firstChild.textContent = text;
    } else title.textContent = text;
    toggle(card, isPhone.matches);
  }
}

isPhone.addEventListener("change", fit);
fit();
