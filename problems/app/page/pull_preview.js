// SPDX-License-Identifier: GPL-3.0-or-later
// The face while a point of it is dragged. The program computes the displacement of each vertex per millimetre of the
// pull; the page adds them up. At release the program makes the real pull.
import {post} from './api.js';

export class PullPreview {
  constructor(scene, point, options) {
    this.scene = scene;
    this.geometry = scene.faceGeometry();
    this.before = this.geometry.attributes.position.array.slice();
    this.moves = null;  // for pulls along x, y and z: each coordinate, in hundredths
    this.by = null;
    this.due = false;
    post('pull', {at: point.toArray(), ...options}).then(({per_mm: all}) => {
      this.moves = all.map((blobs) => blobs.map(SemblanceGeometry.valuesOf));
      if (this.by) { this.show(this.by); }
    }).catch(() => {});  // the pull at release will show the error
  }

  show(by) {
    this.by = by.clone();
    if (!this.moves || this.due) { return; }
    this.due = true;
    requestAnimationFrame(() => {
      this.due = false;
      if (this.by) { this.apply(this.by.toArray()); }
    });
  }

  apply(by) {
    if (this.scene.faceGeometry() !== this.geometry) { return; }  // another face was loaded meanwhile
    const {array} = this.geometry.attributes.position;
    for (let v = 0; v < array.length / 3; ++v) {
      for (let k = 0; k < 3; ++k) {
        const at = 3 * v + k;
        array[at] = this.before[at];
        for (let axis = 0; axis < 3; ++axis) { array[at] += by[axis] * this.moves[axis][k][v] / 100; }
      }
    }
    this.redraw();
  }

  restore() {
    this.by = null;
    if (this.scene.faceGeometry() !== this.geometry) { return; }
    this.geometry.attributes.position.array.set(this.before);
    this.redraw();
  }

  stop() { this.by = null; }

  redraw() {
    this.geometry.attributes.position.needsUpdate = true;
    this.geometry.computeVertexNormals();
    this.scene.draw();
  }
}
