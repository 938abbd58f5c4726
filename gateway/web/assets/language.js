// The reader's language: which one, and the page's words in it. Tables are in /assets/words: a row per phrase,
// a column per language.

const LANGUAGES = ["en", "de"];
const wanted = navigator.languages && navigator.languages.length ? navigator.languages : [navigator.language || "en"];
const languageOf = (tag) => tag.toLowerCase().split("-")[0];

/** For numbers, dates and times: the first of the browser's languages that the tables contain. */
export const locale = wanted.find((tag) => LANGUAGES.includes(languageOf(tag))) || "en";
export const language = languageOf(locale);

/**
 * Gives the text of a row of the tables: `{name}` stands for a field; "one|more" is chosen by the field `n`.
 * `phrase.named(kind, name)` gives `kind.name`, or the bare name if no row has it.
 */
export function speaker(...tables) {
  const rows = Object.assign({}, ...tables);
  const phrase = (key, fields = {}) => {
    if (!(key in rows)) throw new Error(`no words for ${key}`);
    const [one, more = one] = rows[key][LANGUAGES.indexOf(language)].split("|");
    return (fields.n === 1 ? one : more).replace(/\{(\w+)\}/g, (_, name) => fields[name]);
  };
  phrase.named = (kind, name) => (`${kind}.${name}` in rows ? phrase(`${kind}.${name}`) : name.replace(/_/g, " "));
  return phrase;
}

/** Writes the words of elements that name theirs: `data-say` as text, `data-say-label` as name for screen readers. */
export function fill(phrase) {
  document.documentElement.lang = language;
  for (const place of document.querySelectorAll("[data-say]")) place.textContent = phrase(place.dataset.say);
  for (const place of document.querySelectorAll("[data-say-label]")) place.setAttribute("aria-label", phrase(place.dataset.sayLabel));
}
