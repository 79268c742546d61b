// SPDX-License-Identifier: GPL-3.0-or-later
// The state as the program told it last, and who wants to hear of it. The page keeps no truth of its own.
import {get, getFile, post} from './api.js';
import {element} from './dom.js';

export const store = {state: null, schema: null, sites: [], files: null, site: null};

const listeners = [];
export const onState = (listener) => { listeners.push(listener); };

// What a person has to read: a fault, or nothing.
export const say = (words) => {
  const box = document.getElementById('message');
  box.textContent = words || '';
  box.hidden = !words;
};

export const take = (state) => {
  const former = store.state;
  store.state = state;
  for (const listener of listeners) { listener(state, former); }
};

// Does one thing; a refusal is shown, and nothing has changed then. Whether it was done.
export const act = async (name, details = {}) => {
  try {
    take(await post('act', {do: name, ...details}));
    say('');
    return true;
  } catch (error) {
    say(error.message);
    return false;
  }
};

// The browser keeps a file that the program makes; a refusal is shown.
export const keep = async (path, query) => {
  try {
    const {name, blob} = await getFile(path, query);
    const address = URL.createObjectURL(blob);
    element('a', {href: address, download: name}).click();
    setTimeout(() => URL.revokeObjectURL(address), 60000);  // a browser may ask the person first where to
    say('');
  } catch (error) {
    say(error.message);
  }
};

export const refresh = async () => take(await get('state'));

export const begin = async () => {
  const [state, schema, sites, files] = await Promise.all([get('state'), get('schema'), get('sites'), get('files')]);
  Object.assign(store, {schema, sites, files});
  take(state);
};

export const siteOf = (code) => store.sites.find((site) => site.site === code);
export const landmarkOf = (code) => store.state.landmarks.find((landmark) => landmark.site === code);
export const nameOf = (code) => {
  const site = siteOf(code), side = code.endsWith('_l') ? ', left' : code.endsWith('_r') ? ', right' : '';
  return site ? `${site.name}${side}` : code;
};

// A site is in hand: what the next click on the bone places.
const choosers = [];
export const onChoice = (listener) => { choosers.push(listener); };
export const choose = (code) => {
  store.site = code;
  for (const listener of choosers) { listener(code); }
};
