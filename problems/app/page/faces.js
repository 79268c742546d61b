// SPDX-License-Identifier: GPL-3.0-or-later
// The face that is shown: the full face of the run if it belongs to the present state, otherwise a coarse one; and the
// change of the face by the last action.
import {get} from './api.js';
import {sizeOf} from './scene.js';

export class Faces {
  constructor(scene) {
    this.scene = scene;
    this.kind = 'none';      // none, coarse, full
    this.words = '';         // reason if there is no face
    this.notes = [];
    this.faults = [];        // of a full face: [{text, fault, place}]
    this.dowels = [];
    this.kept = null;        // the geometry of the last state; trials do not change it
    this.former = null;      // the geometry that changes are measured from
    this.pinned = false;     // `former` stays the same
    this.coloured = false;
    this.change = null;
    this.listeners = [];
    this.busy = false;       // a request is running
  }

  onChange(listener) { this.listeners.push(listener); }

  // Loads the face of a new state, unless the state has not changed.
  async state(state, former) {
    const same = former && former.revision === state.revision;
    if (same) { return; }
    if (state.landmarks.length < 3) {
      this.clear('A face needs at least three landmarks, better all of them.');
      return;
    }
    await this.load(() => get(state.face.fresh ? 'face' : 'coarse'), state.face.fresh ? 'full' : 'coarse');
  }

  // Shows the face for an option value that is not stored, for example a depth while it is dragged.
  async tryOut(path, value) {
    await this.load(() => get('coarse', {path, value: JSON.stringify(value)}), 'coarse', true);
  }

  // Only the latest request counts. While one runs, the latest one waits and the others are dropped.
  async load(ask, kind, trial = false) {
    this.next = {ask, kind, trial};
    if (this.busy) { return; }
    this.busy = true;
    while (this.next) {
      const {ask: now, kind: what, trial: tried} = this.next;
      this.next = null;
      try {
        this.show(await now(), what, tried);
      } catch (error) {
        this.clear(error.message);
      }
    }
    this.busy = false;
  }

  show(face, kind, trial) {
    if (!this.pinned) { this.former = this.kept; }
    this.kind = kind;
    this.words = '';
    this.notes = face.notes;
    this.faults = face.faults || [];
    this.dowels = face.dowels.length ? face.dowels : this.dowels;
    this.seconds = face.seconds;
    this.finest = face.finest_level;
    this.blob = face.mesh;
    this.scene.put('face', face.mesh);
    if (!trial) { this.kept = this.scene.faceGeometry().clone(); }
    this.scene.putDowels(this.dowels);
    this.scene.putFaults(this.faults);
    this.recolour();
    this.notify();
  }

  clear(words) {
    this.kind = 'none';
    this.words = words;
    this.notes = [];
    this.faults = [];
    this.scene.put('face', null);
    this.scene.putDowels([]);
    this.scene.putFaults([]);
    this.notify();
  }

  recolour() {
    const values = this.former ? this.scene.colourChange(this.coloured ? this.former : null) : null;
    this.change = values ? sizeOf(values) : null;
  }

  colour(on) {
    this.coloured = on;
    this.recolour();
    this.notify();
  }

  pin(on) {
    this.pinned = on;
    const now = this.scene.faceGeometry();
    if (on && now) { this.former = now.clone(); }
    this.recolour();
    this.notify();
  }

  notify() { for (const listener of this.listeners) { listener(this); } }
}
