// SPDX-License-Identifier: GPL-3.0-or-later
// The workbench: numbered steps in the order of the work, one view, and the keys.
import {get} from './api.js';
import {button, element} from './dom.js';
import {isStated, personPanel} from './person_panel.js';
import {reportPanel} from './report_panel.js';
import {keepInSync} from './sync.js';
import {Faces} from './faces.js';
import {Job} from './job.js';
import {comparePanel} from './compare_panel.js';
import {facePanel} from './face_panel.js';
import {landmarkPanel} from './landmark_panel.js';
import {measurePanel} from './measure_panel.js';
import {sculptPanel} from './sculpt_panel.js';
import {skullPanel} from './skull_panel.js';
import {Opener, takeDrops} from './opener.js';
import {Scene} from './scene.js';
import {act, begin, choose, onState, showMessage, store} from './store.js';

// The steps; a step may have several panels. done: whether its tick is shown.
const STEPS = [
  {title: 'Skull', panels: {skull: ['Skull', skullPanel]}, done: ({subject}) => subject.triangles > 0 && !subject.faults.length},
  {title: 'Landmarks', panels: {landmarks: ['Landmarks', landmarkPanel]},
   done: (state) => !state.errors.length && state.landmarks.every(({proposed}) => !proposed) && store.sites.every(({site, standard}) =>
       !standard || [...state.landmarks, ...state.absent].some((one) => one.site === site))},
  {title: 'Person', panels: {person: ['Person', personPanel]}, done: isStated},
  {title: 'Face', panels: {face: ['Face', facePanel]}, done: ({face}) => face.fresh},
  {title: 'Compare, sculpt', panels: {sculpt: ['Sculpt', sculptPanel], compare: ['Compare', comparePanel]}, done: () => false},
  {title: 'Report', panels: {report: ['Report', reportPanel]}, done: ({face}) => face.saved},
  {title: 'View', panels: {measure: ['View', measurePanel]}, done: () => false},
];
const NUMBERED = 6;  // the last one, View, serves all steps

const byId = (id) => document.getElementById(id);

// Each panel is {element, show(), hide(), state(state, former)}. The three functions are optional.
function makeSteps(bench) {
  const panels = new Map(), steps = [];
  let shown = null;
  const number = (n) => (n < NUMBERED ? String(n + 1) : '');
  const mark = (state) => steps.forEach(({made, step}, n) => {
    const done = n < NUMBERED && step.done(state);
    made.firstChild.textContent = done ? '\u2713' : number(n);
    made.classList.toggle('done', done);
  });
  const show = (name) => {
    if (shown === name) { return; }
    if (shown && panels.get(shown).hide) { panels.get(shown).hide(); }
    shown = name;
    const {step} = steps.find((one) => name in one.step.panels), parts = Object.entries(step.panels);
    for (const one of steps) { one.made.setAttribute('aria-selected', String(one.step === step)); }
    byId('parts').hidden = parts.length < 2;
    byId('parts').replaceChildren(...parts.map(([part, [title]]) =>
        button(title, () => show(part), {dataset: {part}, 'aria-pressed': String(part === name)})));
    const panel = panels.get(name);
    byId('panel').replaceChildren(panel.element);
    byId('panel').scrollTop = 0;
    showMessage('');
    bench.opener.dismiss();
    if (panel.show) { panel.show(); }
    if (panel.state && store.state) { panel.state(store.state, null); }
    steps.find((one) => one.step === step).made.scrollIntoView({block: 'nearest', inline: 'nearest'});
  };
  for (const [n, step] of STEPS.entries()) {
    const [first] = Object.keys(step.panels);
    for (const [name, [, make]] of Object.entries(step.panels)) { panels.set(name, make(bench)); }
    const made = button('', () => show(first), {role: 'tab', dataset: {tab: first}, title: `${step.title} (${n + 1})`, 'aria-label': step.title});
    made.append(element('i', {textContent: number(n)}), element('span', {textContent: step.title}));
    steps.push({made, step});
    byId('tabs').append(made);
  }
  onState((state, former) => {
    mark(state);
    const panel = panels.get(shown);
    if (panel && panel.state) { panel.state(state, former); }
  });
  return show;
}

function showHeader(state) {
  byId('subject').textContent = state.subject.name || 'Semblance';
  document.title = `${state.subject.name || 'Semblance'} \u2013 workbench`;
  const {undo, redo} = state.steps;
  byId('undo').disabled = !undo;
  byId('redo').disabled = !redo;
  byId('undo').title = undo ? `undo: ${undo} (Ctrl+Z)` : 'nothing to undo';
  byId('redo').title = redo ? `redo: ${redo} (Ctrl+Shift+Z)` : 'nothing to redo';
  byId('saved').replaceChildren('All work is saved in ', element('code', {textContent: state.folder}), ' \u00b7 the same face from the terminal: ',
      element('code', {textContent: `semblance run ${state.folder}/config.yaml`}));
}

function takeKeys(show) {
  document.addEventListener('keydown', (event) => {
    const types = ['INPUT', 'SELECT', 'TEXTAREA'].includes(event.target.tagName) && event.target.type !== 'range';
    if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === 'z' && !types) {
      event.preventDefault();
      act(event.shiftKey ? 'redo' : 'undo');
    } else if (!types && !event.ctrlKey && !event.altKey && !event.metaKey && /^[1-7]$/.test(event.key)) {
      show(Object.keys(STEPS[Number(event.key) - 1].panels)[0]);
    } else if (event.key === 'Escape') {
      choose(null);
    }
  });
}

// Makes the full face, once the person's sex, build and table are stated.
function makeFace(show) {
  if (!isStated(store.state)) {
    show('person');
    showMessage('Please state the person first: the depths depend on it, and the program assumes nothing.');
    return;
  }
  act('run');
}

async function main() {
  if (!SemblanceGuides.canShow()) {
    byId('view').replaceChildren(element('p', {className: 'empty',
      textContent: 'This browser shows no 3-D pictures: its WebGL is off, or this machine has none. The workbench needs WebGL.'}));
    return;
  }
  const scene = new Scene(byId('view'));
  const bench = {scene, faces: new Faces(scene), store, opener: new Opener(byId('opening'))};
  scene.pace.isBusy = () => bench.faces.busy;
  window.semblance = bench;  // for the browser's console and for tests
  const job = new Job(byId('job'), byId('run'), byId('progress'));
  const show = makeSteps(bench);
  bench.show = show;
  bench.makeFace = () => makeFace(show);
  byId('run').addEventListener('click', bench.makeFace);
  byId('undo').addEventListener('click', () => act('undo'));
  byId('redo').addEventListener('click', () => act('redo'));
  onState(showHeader);
  onState((state, former) => showMeshes(scene, state, former));
  onState((state, former) => bench.faces.state(state, former));
  onState((state) => job.state(state));
  takeKeys(show);
  takeDrops(bench.opener);
  await begin();
  show(store.state.subject.triangles && store.state.landmarks.length ? 'face' : 'skull');
  keepInSync(byId('lost'));
}

async function showMeshes(scene, state, former) {
  if (former && former.subject.revision === state.subject.revision) { return; }
  scene.put('face', null);  // it belongs to another head
  scene.put('head', null);
  const {skull, skin} = await get('meshes');
  scene.put('skull', skull);
  scene.put('skin', skin);
  document.body.classList.toggle('empty-bench', !skull);
}

main().catch((error) => showMessage(error.message));
