// SPDX-License-Identifier: GPL-3.0-or-later
// Behaviour of a report page. A click on the head of a column sorts the table, and a second click reverses the order. A
// field above long tables filters their rows. A link into a folded part opens that part.
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

  // Adds a field that shows only the rows with every typed word, in any cell.
  const addFilter = (table) => {
    const field = document.createElement('input'), count = document.createElement('span');
    field.type = 'search';
    field.placeholder = 'show rows with ...';
    field.setAttribute('aria-label', `filter: ${table.caption ? table.caption.textContent : 'rows'}`);
    const rows = Array.from(table.tBodies[0].rows), texts = rows.map((row) => row.textContent.toLowerCase());
    const filter = () => {
      const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
      let shown = 0;
      rows.forEach((row, k) => {
        row.hidden = !words.every((word) => texts[k].includes(word));
        shown += row.hidden ? 0 : 1;
      });
      count.textContent = words.length ? ` ${shown} of ${rows.length}` : '';
    };
    field.addEventListener('input', filter);
    const label = document.createElement('label');
    label.className = 'filter';
    label.append(field, count);
    table.parentElement.before(label);
    return {clear: () => { field.value = ''; filter(); }};
  };
  const filters = Array.from(document.querySelectorAll('table[data-filter]')).map(addFilter);

  // On a phone a tap shows a picture at full size in a box that scrolls. Another tap shrinks it again.
  for (const picture of document.querySelectorAll('figure > svg.plot, figure > img')) {
    const box = document.createElement('div');
    box.className = 'picture';
    picture.before(box);
    box.append(picture);
    box.addEventListener('click', (event) => {
      if (matchMedia('(max-width: 44rem)').matches && !event.target.closest('a')) { box.classList.toggle('large'); }
    });
  }

  // Opens the folded part that holds the target of a link.
  const reveal = () => {
    const target = location.hash.length > 1 && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (!target) { return; }
    if (target.tagName === 'TR' && target.hidden) { filters.forEach((filter) => filter.clear()); }
    const fold = target.closest('details');
    if (fold && !fold.open) {
      fold.open = true;
      target.scrollIntoView();
    }
  };
  addEventListener('hashchange', reveal);
  addEventListener('beforeprint', () => { for (const fold of document.querySelectorAll('details')) { fold.open = true; } });
  document.addEventListener('click', (event) => {  // a second click on the same link
    const link = event.target.closest('a[href^="#"]');
    if (link && link.hash === location.hash) { reveal(); }
  });
  reveal();

  // On a narrow screen the contents are above the page and stay closed until opened.
  const contents = document.querySelector('nav details');
  if (contents) {
    const narrow = matchMedia('(max-width: 76rem)');
    const fit = () => { contents.open = !narrow.matches; };
    narrow.addEventListener('change', fit);
    contents.addEventListener('click', (event) => { if (narrow.matches && event.target.closest('a')) { contents.open = false; } });
    fit();
  }
})();
