// SPDX-License-Identifier: GPL-3.0-or-later
// The 3-D view: skull, skin, landmarks, depth markers and faces on one or several canvases under one camera. Canvases,
// camera and measuring are those of a report's view (SemblanceStage, SemblanceCamera, SemblanceMeasure).
import {element} from './dom.js';
import {nameOf} from './store.js';

const LAYERS = {
  skull: {label: 'Skull', colour: '#e8dcc4'},
  skin: {label: 'True skin', colour: '#b9c7d6'},
  dowels: {label: 'Depth markers', colour: '#b3261e'},
  face: {label: 'Face', colour: '#d8a58a'},
  head: {label: 'Complete head', colour: '#d8a58a'},
};
const MAPS = {
  change: {title: 'change of the face, outwards +', low_mm: -8, high_mm: 8, no_data: '#8f8f8f',
           colours: ['#053061', '#2166ac', '#4393c3', '#92c5de', '#d1e5f0', '#f7f7f7', '#fddbc7', '#f4a582', '#d6604d',
                     '#b2182b', '#67001f']},
};

// Distances in mm between two faces with the same vertices, along the normals of the former face; outwards is positive.
// Null if the faces have different vertices.
const changeBetween = (former, now) => {
  const a = former.attributes.position, b = now.attributes.position, normals = former.attributes.normal.array;
  if (a.count !== b.count) { return null; }
  const values = new Float32Array(a.count);
  for (let v = 0; v < a.count; ++v) {
    let sum = 0;
    for (let k = 3 * v; k < 3 * v + 3; ++k) { sum += (b.array[k] - a.array[k]) * normals[k]; }
    values[v] = sum;
  }
  return values;
};

// {most, mean}: maximum and mean of the absolute changes in mm.
export const sizeOf = (values) => {
  let most = 0, sum = 0;
  for (const value of values) {
    most = Math.max(most, Math.abs(value));
    sum += Math.abs(value);
  }
  return {most, mean: values.length ? sum / values.length : 0};
};

export class Scene {
  constructor(root) {
    this.root = root;
    this.blobs = {};
    this.pace = new SemblancePace(() => [this.main, ...this.others].map(({stage}) => stage),
                                  () => SemblanceGuides.drawCompass(this.compass, this.shared.camera.camera));
    this.drawSoon = () => this.draw();
    this.shared = {layers: new Map(), mapped: false, range_mm: 4, exaggeration: 1, camera: null, drawSoon: this.drawSoon};
    for (const id of Object.keys(LAYERS)) {
      this.shared.layers.set(id, {shown: id !== 'skin' && id !== 'head', opacity: id === 'face' ? 0.75 : id === 'skin' ? 0.4 : 1});
    }
    this.frames = element('div', {className: 'view3d-frames'});
    root.append(this.frames);  // before the first canvas, which takes its background from the page's style
    this.awaitsFace = false;   // true while the camera is centred on a skull without a face
    this.main = this.makeFrame('');
    this.others = [];
    this.marks = new THREE.Group();
    this.main.stage.extra.add(this.marks);
    this.onPick = null;  // called with (hitOf, ray, among) for a click
    // (event) => {move(event, still), end(), cancel()}, or null for a press that the camera handles.
    this.onDrag = null;
    this.attachDrag(this.main);
    this.compass = element('canvas', {className: 'view3d-compass', width: 224, height: 224});
    this.compass.setAttribute('aria-hidden', 'true');
    this.legend = element('div', {className: 'legend'});
    root.append(this.compass, this.legend);
    new ResizeObserver(this.drawSoon).observe(this.frames);
  }

  makeFrame(title) {
    const canvas = element('canvas', {tabIndex: 0});
    canvas.setAttribute('aria-label', `3-D view ${title}; arrow keys turn it, plus and minus zoom`);
    const tip = element('div', {className: 'view3d-tip', hidden: true});
    const head = element('div', {className: 'view3d-head', textContent: title, hidden: !title});
    const frame = element('div', {className: 'view3d-frame'}, head, element('div', {className: 'view3d-stage'}, canvas, tip));
    this.frames.append(frame);
    const stage = new SemblanceStage(canvas, tip, this.shared);
    stage.show({layers: [], maps: MAPS}, {});
    if (this.shared.camera) { this.shared.camera.attach(canvas); }
    return {frame, canvas, stage, head};
  }

  // Shows a mesh in the format of the program's replies, or removes it if the blob is null.
  put(id, blob, frame = this.main) {
    if (!blob) { frame.stage.drop(id); this.draw(); return; }
    this.blobs = {...this.blobs, [id]: blob};
    frame.stage.put({id, ...LAYERS[id], mesh: id}, {[id]: blob});
    frame.stage.update();
    if (frame === this.main && id === 'skull') { this.frame(); this.shared.camera.look(25, 5); }
    if (frame === this.main && id === 'face' && this.awaitsFace) { this.frame(); this.shared.camera.lookAgain(); }
    this.draw();
  }

  putDowels(dowels, frame = this.main) {
    const named = dowels.map((dowel) => ({...dowel, name: nameOf(dowel.site), fitted: 'unknown'}));
    frame.stage.put({id: 'dowels', ...LAYERS.dowels, dowels: named}, {});
    frame.stage.update();
  }

  // Marks the faults of the face in red, [{text, fault, place}].
  putFaults(faults) { if (this.measure) { this.measure.markFaults(this.main.stage, faults); } }

  // Colours the face by its distance outside `former`, a face with the same vertices.
  colourChange(former, frame = this.main) {
    const face = frame.stage.layers.get('face');
    if (!face) { return null; }
    const values = former && changeBetween(former, face.object.geometry);
    face.object.userData.values = values || undefined;
    face.layer.map = values ? 'change' : undefined;
    face.layer.always_mapped = Boolean(values);
    frame.stage.update();
    this.showLegend();
    this.draw();
    return values;
  }

  // Shows the legend of the visible colours.
  showLegend() {
    const shown = this.others.length ? this.others : [this.main];
    const mapped = this.shared.layers.get('face').shown && shown.some(({stage}) => stage.layers.get('face')?.layer.always_mapped);
    this.legend.replaceChildren(...(mapped ? [SemblanceGuides.legendOf(MAPS.change, this.shared.range_mm)] : []));
  }

  faceGeometry(frame = this.main) {
    const face = frame.stage.layers.get('face');
    return face ? face.object.geometry : null;
  }

  // Centres the camera on the skull and on the face, if there is one: a face may reach far below an incomplete skull.
  frame() {
    const {main: {stage}} = this, box = new THREE.Box3(), around = {skull: 0.12, face: 0.04};
    for (const {layer: {id}, object: {geometry}} of stage.layers.values()) {
      if (!around[id]) { continue; }
      geometry.computeBoundingBox();
      const part = geometry.boundingBox.clone();
      box.union(part.expandByScalar(around[id] * part.getSize(new THREE.Vector3()).length()));
    }
    if (!this.shared.camera) {
      this.shared.camera = new SemblanceCamera(box, this.drawSoon);
      this.shared.camera.attach(this.main.canvas);
      this.attachPick(this.main);
      this.measure = new SemblanceMeasure([stage], this.drawSoon, box);
    }
    this.shared.camera.goRound(box);
    this.measure.box = box;
    this.awaitsFace = !this.faceGeometry();
  }

  // Passes a click without a drag to onPick.
  attachPick({canvas, stage}) {
    let press = null;
    canvas.addEventListener('pointerdown', (event) => { press = {x: event.clientX, y: event.clientY}; });
    canvas.addEventListener('pointerup', (event) => {
      const still = press && Math.hypot(event.clientX - press.x, event.clientY - press.y) < 5;
      press = null;
      const busy = this.measure && this.measure.tool !== 'none';
      if (!still || event.button !== 0 || busy || !this.onPick) { return; }
      this.onPick((ids) => stage.hit(event, ids), stage.ray.ray, (groups) => stage.ray.intersectObjects(groups, true)[0]);
    });
  }

  // If onDrag accepts a press, neither the camera nor onPick gets it until its release. Escape or a second finger
  // cancels the drag.
  attachDrag({canvas, stage}) {
    let grip = null, start = null;
    const over = canvas.parentElement, stop = () => { grip = null; };
    const moved = (event) => Math.hypot(event.clientX - start.clientX, event.clientY - start.clientY);
    over.addEventListener('pointerdown', (event) => {
      if (grip) {
        grip.cancel();
        stop();
      } else if (event.target === canvas && event.button === 0 && !event.shiftKey && this.onDrag && (!this.measure || this.measure.tool === 'none')) {
        grip = this.onDrag(event);
        start = {clientX: event.clientX, clientY: event.clientY, id: event.pointerId, still: true};
        if (!grip) { return; }
        stage.tip.hidden = true;
        canvas.setPointerCapture(event.pointerId);
        canvas.focus({preventScroll: true});
        event.stopPropagation();
      }
    }, {capture: true});
    over.addEventListener('pointermove', (event) => {
      if (!grip || event.pointerId !== start.id) { return; }
      event.stopPropagation();
      start.still = start.still && moved(event) < 5;
      grip.move(event, start.still);
    }, {capture: true});
    over.addEventListener('pointerup', (event) => {
      if (!grip || event.pointerId !== start.id) { return; }
      event.stopPropagation();
      const ended = grip;
      stop();
      ended.end();
    }, {capture: true});
    over.addEventListener('pointercancel', () => { if (grip) { grip.cancel(); stop(); } }, {capture: true});
    document.addEventListener('keydown', (event) => { if (event.key === 'Escape' && grip) { grip.cancel(); stop(); } });
  }

  // Landmarks as balls: [{site, point, colour, hollow, chosen, text}].
  putMarks(marks) {
    this.marks.remove(...this.marks.children);
    const size = this.shared.camera ? 0.006 * this.shared.camera.extent : 2;
    for (const mark of marks) {
      const ball = new THREE.Mesh(
          new THREE.SphereBufferGeometry((mark.chosen ? 1.5 : 1) * size, 16, 12),
          new THREE.MeshPhongMaterial({color: mark.colour, transparent: mark.hollow, opacity: mark.hollow ? 0.45 : 1,
                                       depthWrite: !mark.hollow}));
      ball.position.set(...mark.point);
      ball.userData = {site: mark.site, text: mark.text};
      this.marks.add(ball);
    }
    this.draw();
  }

  // Turns the camera to a point of the head, unless the point is in sight already.
  turnTo(point) {
    const {camera} = this.shared;
    if (!camera || this.isInSight(new THREE.Vector3(...point))) { return; }
    const [x, y, z] = new THREE.Vector3(...point).sub(camera.centre).toArray(), degrees = 180 / Math.PI;
    camera.look(Math.atan2(x, -y) * degrees, Math.max(-35, Math.min(35, Math.atan2(z, Math.hypot(x, y)) * degrees)));
  }

  // True if the point of the bone is inside the picture, and no bone hides it.
  isInSight(point) {
    const {stage, canvas} = this.main, box = canvas.getBoundingClientRect(), eye = this.shared.camera.camera.position;
    const at = point.clone().project(this.shared.camera.camera);
    if (Math.max(Math.abs(at.x), Math.abs(at.y)) > 0.95) { return false; }
    const hit = stage.hit({clientX: box.left + (at.x + 1) / 2 * box.width, clientY: box.top + (1 - at.y) / 2 * box.height}, ['skull']);
    const towards = eye.clone().sub(point).angleTo(point.clone().sub(this.shared.camera.centre));
    return (!hit || hit.distance > eye.distanceTo(point) - 3) && towards < 1.2;
  }

  // Shows an arrow from a to b, or removes it.
  putArrow(from, to) {
    if (this.arrow) { this.main.stage.extra.remove(this.arrow); this.arrow = null; }
    if (from) {
      const shift = to.clone().sub(from);
      this.arrow = new THREE.ArrowHelper(shift.clone().normalize(), from, Math.max(1, shift.length()), 0x0b5c8f, 4, 2.5);
      this.main.stage.extra.add(this.arrow);
    }
    this.draw();
  }

  // Shows faces to compare on further canvases: [{title, face, dowels, former}]. caption: makes the heading from a title
  // and the differences from `former`, if there is one.
  compare(variants, {coloured = true, caption = (title) => [title]} = {}) {
    for (const other of this.others) { other.frame.remove(); other.stage.renderer.dispose(); }
    this.others = [];
    this.root.classList.toggle('comparing', variants.length > 0);
    this.root.classList.toggle('many', variants.length > 3);
    this.main.frame.hidden = variants.length > 0;
    for (const variant of variants) {
      const frame = this.makeFrame(variant.title);
      this.others.push(frame);
      if (this.blobs.skull) { this.put('skull', this.blobs.skull, frame); }
      this.putDowels(variant.dowels, frame);
      this.put('face', variant.face, frame);
      const values = variant.former && changeBetween(variant.former, this.faceGeometry(frame));
      frame.head.replaceChildren(...caption(variant.title, values));
      if (values && coloured) { this.colourChange(variant.former, frame); }
    }
    this.showLegend();
    this.draw();
  }

  update() {
    for (const {stage} of [this.main, ...this.others]) { stage.update(); }
    this.showLegend();
    this.draw();
  }

  draw() { if (this.shared.camera) { this.pace.soon(); } }

  picture() {
    const shown = this.others.length ? this.others : [this.main];
    shown.forEach(({stage, canvas}, n) => {
      stage.draw();
      element('a', {href: canvas.toDataURL('image/png'), download: `workbench-${n + 1}.png`}).click();
    });
  }
}
