// SPDX-License-Identifier: GPL-3.0-or-later
// A click on a column's head sorts the table by it; a second click turns the order round.
'use strict';
(() => {
  const number = (text) => {
    const found = /^[<>\u00b1+]?\s*[-\u2212]?[0-9][0-9.]*(e[-+]?[0-9]+)?/i.exec(text.trim());
    return found ? parseFloat(found[0].replace('\u2212', '-').replace(/^[<>\u00b1+]\s*/, '')) : NaN;
  };
  // Empty cells come last in either order.
  const compare = (a, b, numeric) => {
    const [x, y] = numeric ? [number(a), number(b)] : [a, b];
    return numeric ? x - y : x.localeCompare(y, 'en', {numeric: true});
  };
  const isEmpty = (text) => text === '' || text === '\u2013';

  const sortBy = (table, head) => {
    const column = head.cellIndex, body = table.tBodies[0];
    const direction = head.getAttribute('aria-sort') === 'ascending' ? -1 : 1;
    const numeric = head.classList.contains('n');
    const text = (row) => row.cells[column].textContent;
    const rows = Array.from(body.rows).sort((a, b) => {
      const x = text(a), y = text(b);
      return isEmpty(x) || isEmpty(y) ? isEmpty(x) - isEmpty(y) : direction * compare(x, y, numeric);
    });
    for (const other of head.parentElement.cells) { other.removeAttribute('aria-sort'); }
    head.setAttribute('aria-sort', direction > 0 ? 'ascending' : 'descending');
    body.append(...rows);
  };

  for (const table of document.querySelectorAll('table')) {
    if (table.tBodies[0].rows.length < 2) { continue; }
    for (const head of table.tHead.rows[0].cells) {
      const button = document.createElement('button');
      button.append(...head.childNodes);
      button.title = 'sort by this column';
      button.addEventListener('click', () => sortBy(table, head));
      head.append(button);
    }
  }
})();
