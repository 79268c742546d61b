// SPDX-License-Identifier: GPL-3.0-or-later
// The case and the person. The depths of the face depend on the table, the sex and the build, so the page asks for them
// and assumes none.
import {controlAt} from './controls.js';
import {button, check, element, field, group} from './dom.js';
import {act, store} from './store.js';

const PLAIN_TITLE = 'Facial approximation';  // of a case that began without a configuration; a configuration states the person
const isSet = (state, path) => state.settings.some((setting) => setting.path === path);
const tableOf = (path) => (store.files ? store.files.tables.find((table) => table.path === path) : null);
const isPooled = (state) => Boolean(tableOf(state.values.tissue.table)?.pooled);

const missing = (state) => {
  const {tissue, title} = state.values;
  if (title !== PLAIN_TITLE || tissue.depths === 'measured') { return []; }
  const asked = isPooled(state) ? ['tissue.table'] : ['tissue.table', 'tissue.sex', 'tissue.build'];
  return asked.filter((path) => !isSet(state, path));
};

// True if all facts that the depths depend on are stated.
export const isStated = (state) => missing(state).length === 0;

// A choice by one click, without a value until the person has made it.
function asked(state, path, label, choices, value, note) {
  const open = missing(state).includes(path);
  const one = ([next, text]) => check(text, element('input', {type: 'radio', name: path, value: next,
      checked: !open && next === value, onchange: () => act('set', {path, value: next})}));
  return element('div', {className: `field${open ? ' open' : ''}`, role: 'radiogroup', 'aria-label': label, dataset: {ask: path}},
                 element('span', {textContent: label}), element('div', {}, ...choices.map(one)), note ? element('small', {textContent: note}) : null);
}

const textField = (label, value, send, properties = {}, note) => field(label, element('input', {
    type: 'text', value, spellcheck: false, maxLength: 200, onchange: (event) => send(event.target.value.trim()), ...properties}), note);

function caseGroup(state) {
  const {record} = state.values, set = (name) => (value) => act('set', {path: `record.${name}`, value});
  const notes = element('textarea', {rows: 3, value: record.notes, maxLength: 2000, onchange: () => set('notes')(notes.value)});
  return group('Case',
      textField('name', state.subject.name, (name) => act('name', {name}), {dataset: {record: 'name'}}),
      textField('number', record.number, set('number'), {dataset: {record: 'number'}}),
      field('notes', notes), element('small', {className: 'doc', textContent: 'The report repeats the name, the number, the age and the notes.'}));
}

function personGroup(state) {
  const {tissue, record} = state.values, measured = tissue.depths === 'measured';
  const tables = store.files.tables.map(({path, title}) => [path, title]), about = tableOf(tissue.table);
  if (!about) { tables.unshift([tissue.table, tissue.table.split('/').pop() || 'none']); }
  const chosen = !missing(state).includes('tissue.table');
  const details = chosen && about ? element('small', {className: 'doc', textContent:
      `${about.population}. ${about.citation}`}) : element('small', {className: 'doc', textContent:
      'The table of tissue depths should come from a population like the person\u2019s.'});
  return group('Person',
      measured ? element('p', {className: 'soft', textContent: 'The depths of this head are measured, so no table is used.'}) : null,
      measured ? null : asked(state, 'tissue.table', 'table of depths', tables, tissue.table), measured ? null : details,
      measured || (chosen && isPooled(state)) ? element('p', {className: 'soft', textContent: measured ? '' : 'This table does not distinguish sexes and builds.'}) : null,
      measured || isPooled(state) ? null : asked(state, 'tissue.sex', 'sex', [['male', 'male'], ['female', 'female']], tissue.sex),
      measured || isPooled(state) ? null : asked(state, 'tissue.build', 'build',
          [['emaciated', 'emaciated'], ['normal', 'normal'], ['obese', 'obese']], tissue.build, 'unknown? take normal, and compare the builds in step 5'),
      textField('age', record.age, (value) => act('set', {path: 'record.age', value}), {placeholder: 'e.g. 35 to 50 years, or unknown', dataset: {record: 'age'}}),
      measured ? null : controlAt('tissue.fill_from', 'missing depths from'));
}

// A selector of the field that has the keyboard, so that a new panel can give it back; null for none.
const focusedField = (root) => {
  const now = document.activeElement, row = now && root.contains(now) && now.closest('[data-ask]');
  return row ? `[data-ask="${row.dataset.ask}"] :checked` : now && now.dataset.record ? `[data-record="${now.dataset.record}"]` : null;
};

export function personPanel(bench) {
  const root = element('div');
  let drawn = '';
  const state = (now) => {
    // Not while a person types: a new panel would drop the text.
    const key = JSON.stringify([now.values.record, now.values.tissue, now.values.title, now.subject.name, now.settings]);
    if (key === drawn) { return; }
    drawn = key;
    const open = missing(now).length, focused = focusedField(root);
    root.replaceChildren(
        element('p', {textContent: open ? 'Please state what is known of the person. The program assumes nothing.' : 'The person is stated.'}),
        personGroup(now), caseGroup(now),
        element('div', {className: 'row'}, button('Go on: the face', () => bench.show('face'), {className: 'primary', disabled: open > 0})));
    if (focused) { root.querySelector(focused)?.focus(); }
  };
  return {element: root, state};
}
