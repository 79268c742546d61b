// SPDX-License-Identifier: GPL-3.0-or-later
// The background job: its progress, and a button to stop it.
import {button, element} from './dom.js';
import {act, refresh, showMessage, store} from './store.js';

const NAMES = {run: 'Full face', propose: 'Proposal', open: 'Opening', variants: 'Variants'};
const EVERY_MS = 400;

export class Job {
  constructor(root, runButton) {
    this.root = root;
    this.timer = null;
    this.runButton = runButton;
    runButton.addEventListener('click', () => act('run'));
  }

  state(state) {
    const {job, face} = state, runs = job.state === 'running';
    this.runButton.hidden = runs && job.name === 'run';
    this.runButton.disabled = runs || face.saved || state.landmarks.length === 0;
    this.runButton.textContent = face.saved ? 'The full face is made' : 'Make the full face';
    this.runButton.classList.toggle('primary', !face.saved);
    this.show(job, face);
    if (runs && !this.timer) {
      this.timer = setInterval(() => refresh().catch((error) => { this.stop(); showMessage(error.message); }), EVERY_MS);
    }
    if (!runs) { this.stop(); }
  }

  stop() {
    clearInterval(this.timer);
    this.timer = null;
  }

  show(job, face) {
    const parts = [];
    if (job.state === 'running') {
      const bar = element('progress', {max: 1});
      if (job.fraction !== null) { bar.value = job.fraction; }
      parts.push(element('span', {textContent: `${NAMES[job.name]}: ${job.step}, ${Math.round(job.seconds)} s`}), bar,
                 button('Stop', () => act('cancel')));
    } else if (job.state === 'failed' && job.name !== 'open') {  // the opener shows that
      parts.push(element('span', {className: 'bad', textContent: `${NAMES[job.name]}: ${job.words}`}));
    } else if (job.state === 'stopped' && !face.saved && job.name !== 'open') {
      parts.push(element('span', {textContent: `${NAMES[job.name]}: stopped`}));
    } else if (job.state === 'done' && job.name === 'propose') {
      parts.push(element('span', {textContent: job.words}));
    }
    if (face.saved) {
      parts.push(element('a', {href: 'run/report.html', target: '_blank', rel: 'noopener', textContent: 'Report'}));
    }
    this.root.replaceChildren(...parts);
  }
}

export const isRunning = () => Boolean(store.state) && store.state.job.state === 'running';
