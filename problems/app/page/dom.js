// SPDX-License-Identifier: GPL-3.0-or-later
// Makes elements without parsing markup, so that text from a file is always shown as text.

export const element = (tag, properties = {}, ...children) => {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name === 'dataset') { Object.assign(made.dataset, value); }
    else if (name.startsWith('aria-') || name === 'role' || name === 'list' || name === 'for') { made.setAttribute(name, value); }
    else if (name.startsWith('on')) { made.addEventListener(name.slice(2), value); }
    else { made[name] = value; }
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
};

export const button = (text, act, properties = {}) =>
    element('button', {type: 'button', textContent: text, onclick: act, ...properties});

export const select = (values, chosen, act, properties = {}) => {
  const made = element('select', properties, ...values.map(([value, text]) =>
      element('option', {value, textContent: text, selected: value === chosen})));
  made.addEventListener('change', () => act(made.value));
  return made;
};

export const field = (label, control, note) =>
    element('label', {className: 'field'}, element('span', {textContent: label}), control,
            note ? element('small', {textContent: note}) : null);

export const check = (label, box) => element('label', {className: 'check'}, box, element('span', {textContent: label}));

export const group = (title, ...children) =>
    element('fieldset', {}, element('legend', {textContent: title}), ...children);

export const lines = (texts, className) =>
    texts.length ? element('ul', {className}, ...texts.map((text) => element('li', {textContent: text}))) : null;

export const millimetres = (value, digits = 1) =>
    value === null || value === undefined ? '\u2013' : `${value.toFixed(digits)} mm`;
