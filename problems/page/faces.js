// SPDX-License-Identifier: GPL-3.0-or-later
// Which face is on show: the coarse one at once after each change, the run's where it is of the present choices; and
// what the last change did to it.
import {get} from './api.js';
import {sizeOf} from './changes.js';

export class Faces {
  constructor(scene) {
    this.scene = scene;
    this.kind = 'none';      // none, coarse, full
    this.words = '';         // why there is none
    this.notes = [];
    this.dowels = [];
    this.settled = null;     // the geometry of the last state; what is only tried out is none
    this.former = null;      // the geometry that changes are told from
    this.pinned = false;     // it stays the one that was pinned
    this.coloured = false;
    this.change = null;
    this.listeners = [];
    this.busy = false;       // a face is on its way
  }

  onChange(listener) { this.listeners.push(listener); }

  // A new state: the face follows, if anything that it depends on may have changed.
  async state(state, former) {
    const same = former && former.revision === state.revision;
    if (same) { return; }
    if (state.landmarks.length < 3) {
      this.clear('A face needs three landmarks at least, better all of them.');
      return;
    }
    await this.load(() => get(state.face.fresh ? 'face' : 'coarse'), state.face.fresh ? 'full' : 'coarse');
  }

  // A depth that is being dragged: seen, not yet kept.
  async tryOut(path, value) {
    await this.load(() => get('coarse', {path, value: JSON.stringify(value)}), 'coarse', true);
  }

  // Only the latest answer counts; while one is under way, the latest question waits.
  async load(ask, kind, trial = false) {
    this.next = {ask, kind, trial};
    if (this.busy) { return; }
    this.busy = true;
    while (this.next) {
      const {ask: now, kind: what, trial: tried} = this.next;
      this.next = null;
      try {
        this.take(await now(), what, tried);
      } catch (error) {
        this.clear(error.message);
      }
    }
    this.busy = false;
  }

  take(face, kind, trial) {
    if (!this.pinned) { this.former = this.settled; }
    this.kind = kind;
    this.words = '';
    this.notes = face.notes;
    this.dowels = face.dowels.length ? face.dowels : this.dowels;
    this.seconds = face.seconds;
    this.finest = face.finest_level;
    this.blob = face.mesh;
    this.scene.put('face', face.mesh);
    if (!trial) { this.settled = this.scene.faceGeometry().clone(); }
    this.scene.putDowels(this.dowels);
    this.recolour();
    this.tell();
  }

  clear(words) {
    this.kind = 'none';
    this.words = words;
    this.notes = [];
    this.scene.put('face', null);
    this.scene.putDowels([]);
    this.tell();
  }

  recolour() {
    const values = this.former ? this.scene.colourChange(this.coloured ? this.former : null) : null;
    this.change = values ? sizeOf(values) : null;
  }

  colour(on) {
    this.coloured = on;
    this.recolour();
    this.tell();
  }

  pin(on) {
    this.pinned = on;
    const now = this.scene.faceGeometry();
    if (on && now) { this.former = now.clone(); }
    this.recolour();
    this.tell();
  }

  tell() { for (const listener of this.listeners) { listener(this); } }
}
