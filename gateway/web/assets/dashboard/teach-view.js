// How exactly a load is weighed now, and what is to be done about it on the page /teach.

import { show } from "./known.js";
import { write } from "./page.js";
import { phrase } from "./phrases.js";
import { figure } from "./words.js";

const kg = (x) => figure(x, 0, "kg");

const accuracy = ({ plus_minus_kg: now }) => (now === null ? phrase("teach_nothing") : phrase("teach_now", { kg: kg(now) }));

/** What is lacking before anything can be learnt; then the first of what narrows the accuracy. */
function help({ is_allowed: isAllowed, why_not: whyNot, lacks, helps: [first] }) {
  if (!isAllowed) return phrase("teach_closed", { why: whyNot });
  if (lacks.length) return phrase(`lacks.${lacks[0]}`);
  if (first === undefined) return phrase("teach_help_none");
  return phrase("teach_help_to", { what: phrase.named("help", first.do), kg: kg(first.then_plus_minus_kg) });
}

const questions = ({ questions: { length: n } }) => (n === 0 ? phrase("teach_no_question") : phrase("teach_n_questions", { n }));

show(({ learning }) => {
  if (learning === null) return;
  write("teach-accuracy", accuracy(learning));
  write("teach-help", help(learning));
  write("teach-questions", questions(learning));
}, "learning");
