// SPDX-License-Identifier: GPL-3.0-or-later
// One camera for all views of a report, so that the views move together. It orbits a point, z up. Frame: LPS, +x the
// subject's left, +y back, +z up.
'use strict';
class SemblanceCamera {
  // onChange is called after each move.
  constructor(box, onChange) {
    this.angle = 22;  // degrees across the shorter side; a long lens, as for portraits
    this.camera = new THREE.PerspectiveCamera(this.angle, 1, 1, 5000);
    this.camera.up.set(0, 0, 1);
    this.reach = 1.85;  // initial distance, in extents of the box
    this.onChange = onChange;
    this.goRound(box);
    this.look(0, 0);
  }

  // Orbits this box from the next look on.
  goRound(box) {
    this.centre = box.getCenter(new THREE.Vector3());
    this.extent = box.getSize(new THREE.Vector3()).length();
  }

  // Degrees: turn 0 looks at the face from the front, 90 at the subject's left side; rise 90 looks from above.
  look(turn, rise) {
    this.target = this.centre.clone();
    this.distance = this.reach * this.extent;
    this.turn = turn;
    this.rise = rise;
    this.isShifted = false;  // true once someone moved or zoomed
    this.update();
  }

  // Looks from the same side again, unless someone moved or zoomed.
  lookAgain() { if (!this.isShifted) { this.look(this.turn, this.rise); } }

  rotate(right, up) {
    this.turn -= right;
    this.rise = Math.max(-89, Math.min(89, this.rise + up));
    this.update();
  }

  // Moves the target by shares of the picture's height.
  pan(right, up) {
    const height = 2 * this.distance * Math.tan(this.camera.fov * Math.PI / 360);
    const axes = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()];
    this.camera.matrixWorld.extractBasis(...axes);
    this.target.addScaledVector(axes[0], -right * height).addScaledVector(axes[1], -up * height);
    this.isShifted = true;
    this.update();
  }

  zoom(factor) {
    this.distance = Math.max(0.1 * this.extent, Math.min(8 * this.extent, this.distance * factor));
    this.isShifted = true;
    this.update();
  }

  update() {
    const turn = this.turn * Math.PI / 180, rise = Math.min(89.9, this.rise) * Math.PI / 180;
    const from = new THREE.Vector3(
        Math.sin(turn) * Math.cos(rise), -Math.cos(turn) * Math.cos(rise), Math.sin(rise));
    this.camera.position.copy(this.target).addScaledVector(from, this.distance);
    this.camera.near = Math.max(this.extent / 500, this.distance - 2 * this.extent);
    this.camera.far = this.distance + 2 * this.extent;
    this.camera.lookAt(this.target);
    this.camera.updateMatrixWorld();
    this.onChange();
  }

  // A drag turns the view. A drag with the right button, shift or two fingers shifts it. Wheel and pinch zoom. Arrow
  // keys turn. With wheel 'always' the wheel always zooms. With 'asked' it zooms between a click on the canvas and the
  // pointer leaving it, and with Ctrl or in full screen; otherwise the wheel scrolls the page.
  attach(canvas, {wheel = 'always'} = {}) {
    const fingers = new Map();
    let asked = wheel === 'always';
    canvas.addEventListener('pointerleave', () => { asked = wheel === 'always'; });
    const spread = () => {
      const [a, b] = [...fingers.values()];
      return Math.hypot(a.x - b.x, a.y - b.y);
    };
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('pointerdown', (event) => {
      canvas.setPointerCapture(event.pointerId);
      asked = true;
      fingers.set(event.pointerId, {x: event.clientX, y: event.clientY});
    });
    const release = (event) => fingers.delete(event.pointerId);
    canvas.addEventListener('pointerup', release);
    canvas.addEventListener('pointercancel', release);
    canvas.addEventListener('pointermove', (event) => {
      const finger = fingers.get(event.pointerId);
      if (!finger) { return; }
      const before = fingers.size === 2 ? spread() : 0;
      const right = (event.clientX - finger.x) / canvas.clientHeight;
      const down = (event.clientY - finger.y) / canvas.clientHeight;
      finger.x = event.clientX;
      finger.y = event.clientY;
      if (fingers.size === 2) { this.zoom(before / Math.max(1, spread())); }
      if (fingers.size === 2 || event.buttons === 2 || event.shiftKey) {
        this.pan(right / fingers.size, -down / fingers.size);
      } else {
        this.rotate(180 * right, 180 * down);
      }
    });
    canvas.addEventListener('wheel', (event) => {
      if (!asked && !event.ctrlKey && !event.metaKey && !document.fullscreenElement) { return; }
      event.preventDefault();
      this.zoom(Math.exp(Math.max(-0.3, Math.min(0.3, event.deltaY / 500))));
    }, {passive: false});
    canvas.addEventListener('keydown', (event) => {
      const moves = {ArrowLeft: [-10, 0], ArrowRight: [10, 0], ArrowUp: [0, 10], ArrowDown: [0, -10]};
      const move = moves[event.key];
      if (move) { this.rotate(...move); }
      if (event.key === '+' || event.key === '-') { this.zoom(event.key === '+' ? 0.9 : 1.1); }
      if (move || event.key === '+' || event.key === '-') { event.preventDefault(); }
    });
  }
}
