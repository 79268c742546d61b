// SPDX-License-Identifier: GPL-3.0-or-later
// The last state from the program, and the listeners to its changes. The page stores no decisions of its own.
import {get, getFile, post} from './api.js';
import {element} from './dom.js';

export const store = {state: null, schema: null, sites: [], files: null, site: null};

const listeners = [];
export const onState = (listener) => { listeners.push(listener); };

// Shows a message to the person, or hides it if the text is empty.
export const showMessage = (words) => {
  const box = document.getElementById('message');
  box.textContent = words || '';
  box.hidden = !words;
};

// whole: show everything again, because another process counts its changes from the beginning.
export const setState = (state, {whole = false} = {}) => {
  const former = whole ? null : store.state;
  store.state = state;
  for (const listener of listeners) { listener(state, former); }
};

// Performs one action. If the program refuses it, nothing changes and the reason is shown. Returns true if it was done.
export const act = async (name, details = {}) => {
  try {
    const state = await post('act', {do: name, ...details});
    showMessage('');  // first: a listener may show why a job that has already ended has failed
    setState(state);
    return true;
  } catch (error) {
    showMessage(error.message);
    return false;
  }
};

// Endings of the files in which the program exports a face.
export const FACE_FORMATS = ['.ply', '.obj', '.stl', '.glb', '.off', '.step', '.iges', '.vtu'];

// Saves a file made by the program through the browser. If the program refuses, the reason is shown.
export const download = async (path, query) => {
  try {
    const {name, blob} = await getFile(path, query);
    const address = URL.createObjectURL(blob);
    element('a', {href: address, download: name}).click();
    setTimeout(() => URL.revokeObjectURL(address), 60000);  // the browser may ask for a place first
    showMessage('');
  } catch (error) {
    showMessage(error.message);
  }
};

export const refresh = async () => setState(await get('state'));

export const begin = async () => {
  const [state, schema, sites, files] = await Promise.all([get('state'), get('schema'), get('sites'), get('files')]);
  Object.assign(store, {schema, sites, files});
  setState(state);
};

export const siteOf = (code) => store.sites.find((site) => site.site === code);
export const landmarkOf = (code) => store.state.landmarks.find((landmark) => landmark.site === code);
export const nameOf = (code) => {
  const site = siteOf(code), side = code.endsWith('_l') ? ', left' : code.endsWith('_r') ? ', right' : '';
  return site ? `${site.name}${side}` : code;
};

// The chosen site, which the next click on the bone places.
const choosers = [];
export const onChoice = (listener) => { choosers.push(listener); };
// stay: the view does not turn to the site.
export const choose = (code, {stay = false} = {}) => {
  store.site = code;
  for (const listener of choosers) { listener(code, stay); }
};
