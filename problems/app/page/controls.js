// SPDX-License-Identifier: GPL-3.0-or-later
// A control for any option, made from the JSON Schema of the program's options: name, range, unit, meaning. A new option
// of the program therefore appears in the page without a change here.
import {element, field, select} from './dom.js';
import {act, store} from './store.js';

// The kind of an entry of the schema: {kind, ...}.
export function kindOf(schema) {
  if (schema.enum) { return {kind: 'word', words: schema.enum}; }
  if (schema.anyOf) {
    const parts = schema.anyOf, objects = parts.filter((part) => part.properties && part.properties.type);
    if (objects.length) { return {kind: 'variant', names: objects.map((part) => part.properties.type.const), objects}; }
    if (parts.some((part) => part.const === 'auto')) { return {kind: 'auto', inner: parts.find((part) => part.const !== 'auto')}; }
    if (parts.some((part) => part.type === 'null')) { return {kind: 'optional', inner: parts.find((part) => part.type !== 'null')}; }
  }
  if (schema.type === 'object' && schema.properties) { return {kind: 'struct', properties: schema.properties}; }
  if (schema.type === 'boolean') { return {kind: 'bool'}; }
  if (schema.type === 'integer' || schema.type === 'number') { return {kind: 'number', whole: schema.type === 'integer', schema}; }
  if (schema.type === 'string') { return {kind: 'text'}; }
  return {kind: 'other'};
}

// Splits a description "meaning [mm]" into meaning and unit.
export function documentation(schema) {
  const text = schema.description || '', found = /\s*\[([^\]]*)\]$/.exec(text);
  return {doc: found ? text.slice(0, found.index) : text, unit: found ? found[1] : ''};
}

const rangeWords = (schema) => {
  const {minimum: low, maximum: high} = schema;
  return low !== undefined && high !== undefined ? `${low} to ${high}` : low !== undefined ? `${low} or more` : high !== undefined ? `at most ${high}` : '';
};

function numberControl(schema, value, send) {
  const {minimum: low, maximum: high} = schema, whole = schema.type === 'integer';
  const made = element('input', {type: 'number', value, step: whole ? 1 : 'any'});
  if (low !== undefined) { made.min = low; }
  if (high !== undefined) { made.max = high; }
  made.addEventListener('change', () => { if (made.value !== '') { send(Number(made.value)); } });
  return made;
}

const pathChoices = (path) => {
  const files = store.files || {};
  return path.endsWith('table') || path.endsWith('fill_from') ? files.tables : path === 'network' ? files.networks : null;
};

function textControl(path, value, send) {
  const choices = pathChoices(path);
  if (!choices) {
    return element('input', {type: 'text', value, spellcheck: false, onchange: (event) => send(event.target.value)});
  }
  const known = choices.map(({path: file, title}) => [file, title]);
  if (!known.some(([file]) => file === value)) { known.unshift([value, value ? value.split('/').pop() : 'none']); }
  else if (path.endsWith('fill_from')) { known.unshift(['', 'none']); }
  return select(known, value, send);
}

// The control of one value, or null if the value must be edited as JSON text.
function simpleControl(path, schema, value, send) {
  const {kind, inner, words} = kindOf(schema);
  if (kind === 'word') { return select(words.map((word) => [word, word]), value, send); }
  if (kind === 'bool') { return element('input', {type: 'checkbox', checked: value, onchange: (event) => send(event.target.checked)}); }
  if (kind === 'number') { return numberControl(schema, value, send); }
  if (kind === 'text') { return textControl(path, value ?? '', send); }
  if (kind === 'auto' || kind === 'optional') {
    const made = element('input', {type: 'text', value: value === null ? '' : value, placeholder: kind === 'auto' ? 'auto' : 'none'});
    made.addEventListener('change', () => {
      const text = made.value.trim(), none = kind === 'auto' ? 'auto' : null;
      send(text === '' || text === 'auto' ? none : inner.type === 'number' || inner.type === 'integer' ? Number(text) : text);
    });
    return made;
  }
  return null;
}

function jsonControl(value, send) {
  const made = element('textarea', {rows: 2, value: JSON.stringify(value), spellcheck: false});
  made.addEventListener('change', () => {
    try {
      made.setCustomValidity('');
      send(JSON.parse(made.value));
    } catch (error) {
      made.setCustomValidity(`This is not valid JSON: ${error.message}`);
      made.reportValidity();
    }
  });
  return made;
}

const isSet = (path) => store.state.settings.some((setting) => setting.path === path || setting.path.startsWith(`${path}.`));

function resetButton(path) {
  const made = element('button', {type: 'button', className: 'reset', textContent: '\u21ba', title: `${path}: back to its value at the beginning`});
  made.setAttribute('aria-label', `reset ${path}`);
  made.addEventListener('click', (event) => { event.preventDefault(); act('unset', {path}); });
  return made;
}

// A row for one option: name, unit, control, with range and meaning as a tooltip.
export function control(path, schema, value, name = path.split('.').pop()) {
  const send = (next) => act('set', {path, value: next});
  const {doc, unit} = documentation(schema), range = rangeWords(kindOf(schema).inner || schema);
  const made = simpleControl(path, schema, value, send) || jsonControl(value, send);
  made.title = [doc, range].filter((text) => text).join('; ');
  const row = field(`${name.replaceAll('_', ' ').replace(/ mm$/, '').replace(/ deg$/, '')}${unit ? ` (${unit})` : ''}`, made);
  row.dataset.path = path;
  if (isSet(path)) { row.append(resetButton(path)); }
  return row;
}

// A folded row for an option and all options below it.
export function tree(path, schema, value, matches = () => true, open = false) {
  const kind = kindOf(schema), name = path.split('.').pop();
  if (kind.kind !== 'struct' && kind.kind !== 'variant') {
    return matches(path, schema) ? [control(path, schema, value), docLine(schema)] : [];
  }
  const properties = kind.kind === 'struct' ? kind.properties : propertiesOf(kind, value);
  const whole = matches(path, schema);
  const parts = Object.entries(properties).filter(([key]) => key !== 'type').flatMap(([key, below]) =>
      tree(`${path}.${key}`, below, value ? value[key] : undefined, whole ? () => true : matches, open));
  const type = kind.kind === 'variant' && (whole || parts.length) ? [typeControl(path, kind, value)] : [];
  if (!parts.length && !type.length) { return []; }
  return [element('details', {open}, element('summary', {textContent: name.replaceAll('_', ' ')}), docLine(schema), ...type, ...parts)];
}

const docLine = (schema) => {
  const {doc} = documentation(schema);
  return doc ? element('small', {className: 'doc', textContent: doc}) : '';
};

const propertiesOf = (kind, value) => {
  const chosen = kind.objects[kind.names.indexOf(value && value.type)];
  return chosen ? chosen.properties : {};
};

export function typeControl(path, kind, value, name) {
  const row = field(name || 'kind', select(kind.names.map((word) => [word, word.replaceAll('_', ' ')]), value && value.type,
                                           (word) => act('set', {path: `${path}.type`, value: word})));
  row.dataset.path = `${path}.type`;
  if (isSet(path)) { row.append(resetButton(path)); }
  return row;
}

// The schema and the value at a path. Variants are followed as they are chosen at present.
export function at(path) {
  let schema = store.schema, value = store.state.values;
  for (const key of path.split('.')) {
    const kind = kindOf(schema);
    schema = (kind.kind === 'variant' ? propertiesOf(kind, value) : kind.properties || {})[key];
    value = value ? value[key] : undefined;
    if (!schema) { return null; }
  }
  return {schema, value};
}

// A control for the option at the path, or null if the present options have no such option.
export function controlAt(path, name) {
  const found = at(path);
  if (!found) { return null; }
  const kind = kindOf(found.schema);
  return kind.kind === 'variant' ? typeControl(path, kind, found.value, name) : control(path, found.schema, found.value, name);
}
