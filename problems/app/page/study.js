// SPDX-License-Identifier: GPL-3.0-or-later
// The page of a running study. It asks for the progress every second. After a trial has ended it takes the main part of the present
// report, but never spends more than a fifth of the time on reports.
'use strict';
(() => {
  const part = (id) => document.getElementById(id), main = document.querySelector('main');
  let reported = -1, next = 0;

  const headings = (folds) => new Set([...folds].map((fold) => fold.querySelector('summary').textContent));

  const showReport = async () => {
    const reply = await fetch('run/report.html');
    if (!reply.ok) { return; }
    const html = await reply.text();  // its style and scripts, which this page must not load, are outside of main
    const page = document.createElement('main');
    page.innerHTML = html.slice(html.indexOf('<main>') + 6, html.lastIndexOf('</main>'));
    page.querySelector('#view3d')?.closest('section').remove();  // its scripts do not run here
    for (const script of page.querySelectorAll('script')) { script.remove(); }
    for (const link of page.querySelectorAll('a[href]:not([href^="#"])')) { link.replaceWith(...link.childNodes); }
    const open = headings(main.querySelectorAll('details[open]'));
    for (const fold of page.querySelectorAll('details')) { fold.open = open.has(fold.querySelector('summary').textContent); }
    main.replaceChildren(...page.childNodes);
  };

  const showState = (state) => {
    document.title = part('title').textContent = state.title;
    part('bar').max = Math.max(1, state.trials);
    part('bar').value = state.finished;
    part('words').textContent = state.over ? `${state.words}. The study has ended; its report is ${state.report}` : state.words;
    part('failed').hidden = state.failed.length === 0;
    part('failed').replaceChildren(...state.failed.map((line) => Object.assign(document.createElement('p'), {textContent: line})));
  };

  const look = async () => {
    try {
      const state = await (await fetch('api/state')).json();
      showState(state);
      const has_plan = state.trials > 0;  // before, there is nothing to report
      if (has_plan && (state.over || (state.finished !== reported && performance.now() > next))) {
        const begin = performance.now();
        await showReport();
        reported = state.finished;
        next = performance.now() + 4 * (performance.now() - begin);
      }
      if (state.over) { return; }
    } catch {
      part('words').textContent += '. The program no longer answers: it has ended.';
      return;
    }
    setTimeout(look, 1000);
  };
  look();
})();
