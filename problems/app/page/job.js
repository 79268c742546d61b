// SPDX-License-Identifier: GPL-3.0-or-later
// The background job: its progress, and a button to stop it.
import {button, element} from './dom.js';
import {act, refresh, showMessage, store} from './store.js';

const NAMES = {run: 'Full face', propose: 'Proposal', open: 'Opening', variants: 'Variants'};
const EVERY_MS = 400;

// The link to the report of the last run; marked if the report belongs to another state.
export const reportLink = ({saved}) => element('a', {href: 'run/report.html', target: '_blank', rel: 'noopener', className: saved ? '' : 'stale',
    textContent: saved ? 'Report' : 'Report (out of date)', title: saved ? '' : 'The case has changed since this report was made; make the face again.'});

export class Job {
  constructor(root, runButton, progress) {
    this.root = root;
    this.timer = null;
    this.runButton = runButton;
    this.progress = progress;
    this.steps = [];  // of the running job: [{step, from}], from: its start in seconds
  }

  state(state) {
    const {job, face} = state, runs = job.state === 'running';
    this.runButton.hidden = runs && job.name === 'run';
    this.runButton.disabled = runs || face.saved || state.landmarks.length === 0;
    this.runButton.textContent = face.saved ? 'The full face is made' : 'Make the full face';
    this.runButton.classList.toggle('primary', !face.saved);
    this.show(state);
    this.showSteps(job, runs);
    if (runs && !this.timer) {
      this.timer = setInterval(() => refresh().catch((error) => { this.stop(); showMessage(error.message); }), EVERY_MS);
    }
    if (!runs) { this.stop(); }
  }

  stop() {
    clearInterval(this.timer);
    this.timer = null;
  }

  // Lists the steps of the running job: the ended ones with their duration, the present one with its progress.
  showSteps(job, runs) {
    if (!runs) { this.steps = []; }
    const step = job.step.split(',')[0];  // without the round of a step
    if (runs && (!this.steps.length || this.steps.at(-1).step !== step)) { this.steps.push({step, from: job.seconds}); }
    this.progress.hidden = !runs;
    this.progress.replaceChildren(...this.steps.map(({step: name, from}, n) => {
      const next = this.steps[n + 1], part = job.fraction !== null && !next ? `, ${Math.round(100 * job.fraction)} %` : '';
      return element('li', {className: next ? 'done' : ''}, name,
                     element('small', {textContent: `${((next ? next.from : job.seconds) - from).toFixed(1)} s${part}`}));
    }));
    this.progress.scrollTop = this.progress.scrollHeight;
  }

  show({job, face, landmarks}) {
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
    } else if (job.state === 'done' && job.name === 'propose' && landmarks.some(({proposed}) => proposed)) {
      parts.push(element('span', {textContent: job.words}));
    }
    if (face.there) { parts.push(reportLink(face)); }
    this.root.replaceChildren(...parts);
  }
}

export const isRunning = () => Boolean(store.state) && store.state.job.state === 'running';
