// SPDX-License-Identifier: GPL-3.0-or-later
// Measuring in the 3-D view of reports and of the workbench: distances, tissue depth, pinned labels, a clipping plane
// with its section, and full screen.
'use strict';
const SemblanceSurface = (() => {
  // A binary heap of [distance, vertex], nearest first.
  class Heap {
    constructor() { this.items = []; }
    push(item) {
      const items = this.items;
      let at = items.push(item) - 1;
      while (at > 0 && items[(at - 1) >> 1][0] > item[0]) {
        items[at] = items[(at - 1) >> 1];
        at = (at - 1) >> 1;
      }
      items[at] = item;
    }
    pop() {
      const items = this.items, first = items[0], last = items.pop();
      for (let at = 0; items.length;) {
        let child = 2 * at + 1;
        if (child + 1 < items.length && items[child + 1][0] < items[child][0]) { ++child; }
        if (child >= items.length || items[child][0] >= last[0]) { items[at] = last; break; }
        items[at] = items[child];
        at = child;
      }
      return first;
    }
  }

  const distance = (a, b) => a.distanceTo(b);

  // The arrival at c of a wave that reached a and b at the distances s and t. If the straight way crosses the edge ab,
  // the wave is spherical; otherwise it goes round by a or b.
  const through = (a, b, c, s, t) => {
    const along = b.clone().sub(a), length = along.length();
    const round = Math.min(s + distance(a, c), t + distance(b, c));
    if (!(length > 0)) { return round; }
    along.divideScalar(length);
    const x = (s * s - t * t + length * length) / (2 * length), y2 = s * s - x * x;
    const to = c.clone().sub(a), cx = to.dot(along), cy = Math.sqrt(Math.max(0, to.lengthSq() - cx * cx));
    if (!(y2 >= 0)) { return round; }
    const y = Math.sqrt(y2), crossing = x + (cx - x) * y / (y + cy);
    return crossing >= 0 && crossing <= length ? Math.hypot(cx - x, cy + y) : round;
  };

  const cornersOf = (geometry, triangle) => [0, 1, 2].map((k) => geometry.index.array[3 * triangle + k]);
  const vertexOf = (geometry, v) => new THREE.Vector3().fromArray(geometry.attributes.position.array, 3 * v);

  // The length in mm from hit to hit along one surface, Infinity if they are not connected, and an approximate way.
  // Fast marching with spherical waves in each triangle: exact on a plane, a few percent too long elsewhere.
  const alongSurface = (geometry, from, to) => {
    const index = geometry.index.array, vertices = geometry.attributes.position.count;
    const first = new Int32Array(vertices + 1), times = new Float64Array(vertices).fill(Infinity);
    for (const v of index) { ++first[v + 1]; }
    for (let v = 0; v < vertices; ++v) { first[v + 1] += first[v]; }
    const next = first.slice(), trianglesAt = new Int32Array(index.length);
    index.forEach((v, k) => { trianglesAt[next[v]++] = Math.floor(k / 3); });
    const done = new Uint8Array(vertices), came = new Int32Array(vertices).fill(-1), heap = new Heap();
    for (const v of cornersOf(geometry, from.faceIndex)) {
      times[v] = distance(vertexOf(geometry, v), from.point);
      heap.push([times[v], v]);
    }
    const ends = cornersOf(geometry, to.faceIndex);
    while (heap.items.length && !ends.every((v) => done[v])) {
      const [, v] = heap.pop();
      if (done[v]) { continue; }
      done[v] = 1;
      for (let k = first[v]; k < first[v + 1]; ++k) {
        const corners = cornersOf(geometry, trianglesAt[k]);
        for (const c of corners) {
          if (done[c]) { continue; }
          const other = corners.find((o) => o !== v && o !== c);
          const time = done[other]
              ? through(vertexOf(geometry, v), vertexOf(geometry, other), vertexOf(geometry, c), times[v], times[other])
              : times[v] + distance(vertexOf(geometry, v), vertexOf(geometry, c));
          if (time < times[c]) {
            times[c] = time;
            came[c] = v;
            heap.push([time, c]);
          }
        }
      }
    }
    if (from.faceIndex === to.faceIndex) { return {length: distance(from.point, to.point), way: [from.point, to.point]}; }
    let length = Infinity, last = -1;
    ends.forEach((v, k) => {
      const o = ends[(k + 1) % 3], a = vertexOf(geometry, v), b = vertexOf(geometry, o);
      const found = through(a, b, to.point, times[v], times[o]);
      if (found < length) { length = found; last = times[v] < times[o] ? v : o; }
    });
    return {length, way: wayDown(geometry, {times, came, first, trianglesAt}, from, to, last)};
  };

  // Follows the slope of the arrival times from `to` down to `from`, triangle by triangle. If the slope leads back, the
  // way continues through a corner.
  const wayDown = (geometry, field, from, to, last) => {
    const {times, came, first, trianglesAt} = field, way = [to.point];
    const around = (v) => Array.from(trianglesAt.subarray(first[v], first[v + 1]));
    let point = to.point.clone(), triangle = to.faceIndex, former = -1;
    for (let step = 0; step < 4000 && triangle !== from.faceIndex; ++step) {
      const corners = cornersOf(geometry, triangle);
      const exit = corners.every((v) => isFinite(times[v])) ? exitOf(geometry, corners, times, point) : null;
      const next = exit && around(exit.edge[0]).find((t) => t !== triangle && cornersOf(geometry, t).includes(exit.edge[1]));
      if (next !== undefined && next !== null && next !== former) {
        point = exit.point;
        former = triangle;
        triangle = next;
        way.push(point);
        continue;
      }
      const corner = exit ? exit.edge.reduce((v, o) => times[o] < times[v] ? o : v) : last;
      const ahead = came[corner];
      if (ahead < 0) { break; }
      way.push(vertexOf(geometry, corner), vertexOf(geometry, ahead));
      last = ahead;
      former = -1;
      const nexts = around(ahead), low = (t) => Math.min(...cornersOf(geometry, t).map((v) => times[v]));
      triangle = nexts.reduce((t, o) => low(o) < low(t) ? o : t);
      const middle = cornersOf(geometry, triangle).reduce((sum, v) => sum.add(vertexOf(geometry, v)), new THREE.Vector3()).divideScalar(3);
      point = vertexOf(geometry, ahead).lerp(middle, 1e-3);
    }
    return [...way, from.point];
  };

  // The place {point, edge} where the steepest descent from a point of a triangle leaves the triangle.
  const exitOf = (geometry, corners, times, point) => {
    const [a, b, c] = corners.map((v) => vertexOf(geometry, v)), [ta, tb, tc] = corners.map((v) => times[v]);
    const e1 = b.clone().sub(a), e2 = c.clone().sub(a), n = e1.clone().cross(e2), size = n.lengthSq();
    if (!(size > 0)) { return null; }
    const down = e2.clone().cross(n).multiplyScalar(ta - tb).add(n.clone().cross(e1).multiplyScalar(ta - tc)).divideScalar(size);
    // Barycentric coordinates at the point, and their change along the way.
    const sharesOf = (way) => {
      const share2 = n.dot(e1.clone().cross(way)) / size, share1 = n.dot(way.clone().cross(e2)) / size;
      return [-share1 - share2, share1, share2];
    };
    const at = sharesOf(point.clone().sub(a)), change = sharesOf(down);
    at[0] += 1;
    let nearest = Infinity, out = -1;
    for (let k = 0; k < 3; ++k) {
      const reach = change[k] < -1e-12 ? Math.max(0, at[k]) / -change[k] : Infinity;
      if (reach < nearest) { nearest = reach; out = k; }
    }
    return out < 0 ? null : {point: point.clone().addScaledVector(down, nearest), edge: corners.filter((_, k) => k !== out)};
  };

  return {alongSurface, through};
})();

class SemblanceMeasure {
  // stages: the canvases to measure on, all with one camera. draw(): draws them soon. box: the bounds of the scene, in mm.
  constructor(stages, draw, box) {
    this.stages = stages;
    this.draw = draw;
    this.box = box;
    this.unit = ` ${stages[0]?.description?.unit ?? 'mm'}`.trimEnd();
    this.digits = Math.max(1, Math.ceil(3 - Math.log10(Math.max(1e-9, box.getSize(new THREE.Vector3()).length()))));
    this.tool = 'none';
    this.marks = [];
    this.pending = null;
    this.clip = {axis: 'none', at: 0.5, flipped: false};
    this.section = new SemblanceSection(this.unit, this.digits);
    for (const stage of stages) { this.attach(stage); }
    if (stages.length) { stages[0].afterDraw.push(() => this.section.show(stages[0], this.clip, this.box)); }
  }

  // A press that does not move is a click. A drag turns the head.
  attach(stage) {
    let press = null;
    stage.overlay = document.createElement('div');
    stage.overlay.className = 'view3d-overlay';
    stage.canvas.after(stage.overlay);
    stage.canvas.addEventListener('pointerdown', (event) => { press = {x: event.clientX, y: event.clientY}; });
    stage.canvas.addEventListener('pointerup', (event) => {
      const still = press && Math.hypot(event.clientX - press.x, event.clientY - press.y) < 5;
      press = null;
      if (still && event.button === 0 && this.tool !== 'none') { this.click(stage, event); }
    });
    stage.afterDraw.push(() => this.placeLabels(stage));
  }

  click(stage, event) {
    const surfaces = [...stage.layers.values()].filter(({layer}) => layer.mesh).map(({layer}) => layer.id);
    const hit = stage.hit(event, this.tool === 'depth' ? ['skull', 'depth'] : surfaces);
    if (!hit || !hit.object.geometry || !hit.object.geometry.index || hit.faceIndex === undefined) {
      this.setStatus(this.tool === 'depth' ? 'Depth is measured from bone: show the skull and click on it.' : 'There is no surface there.');
      return;
    }
    if (this.tool === 'distance') { this.distance(stage, hit); }
    if (this.tool === 'depth') { this.depth(stage, hit); }
    if (this.tool === 'label') { this.label(stage, hit); }
  }

  distance(stage, hit) {
    const start = this.pending;
    if (!start || start.stage !== stage) {
      this.pending = {stage, hit};
      this.setStatus('Now click the second point.');
      return;
    }
    this.pending = null;
    const straight = start.hit.point.distanceTo(hit.point), same = start.hit.object === hit.object;
    const {length, way} = same ? SemblanceSurface.alongSurface(hit.object.geometry, start.hit, hit)
                               : {length: NaN, way: [start.hit.point, hit.point]};
    const along = isFinite(length) ? `, along the surface ${length.toFixed(this.digits)}${this.unit}`
                                   : same ? ', not joined along the surface' : '';
    this.mark(stage, hit.point, `${straight.toFixed(this.digits)}${this.unit}${along}`, isFinite(length) ? way : [start.hit.point, hit.point]);
  }

  // The first point of a surface on the ray, from either side. Translucent surfaces are one-sided otherwise.
  static firstHit(ray, object) {
    const {material} = object, side = material.side;
    material.side = THREE.DoubleSide;
    const [first] = ray.intersectObject(object);
    material.side = side;
    return first;
  }

  // Measures from bone along its normal to each visible face.
  depth(stage, hit) {
    const geometry = hit.object.geometry, normals = geometry.attributes.normal.array, normal = new THREE.Vector3();
    for (const v of [hit.face.a, hit.face.b, hit.face.c]) { normal.add(new THREE.Vector3().fromArray(normals, 3 * v)); }
    normal.normalize();
    if (normal.dot(stage.ray.ray.direction) > 0) { normal.negate(); }
    const parts = [], ray = new THREE.Raycaster(hit.point.clone().addScaledVector(normal, 1e-3), normal, 0, 80);
    let end = hit.point.clone().addScaledVector(normal, 5);
    for (const id of ['face', 'skin', 'implicit']) {
      const found = stage.layers.get(id);
      const far = found && found.object.visible ? SemblanceMeasure.firstHit(ray, found.object) : null;
      if (far) {
        parts.push(`${found.layer.label.toLowerCase()} ${far.distance.toFixed(1)} mm`);
        if (parts.length === 1) { end = far.point; }
      }
    }
    this.mark(stage, end, parts.length ? `depth: ${parts.join(', ')}` : 'no face above this point', [hit.point, end]);
  }

  label(stage, hit) {
    const text = (this.text.value || '').trim();
    if (!text) { this.setStatus('Write the label first.'); this.text.focus(); return; }
    this.mark(stage, hit.point, text, []);
  }

  // Marks the faults of a face, [{text, fault, place}], in red, in place of those of the face before.
  markFaults(stage, faults) {
    const words = this.status ? this.status.textContent : '';  // of the last measurement
    for (const mark of this.marks.filter((other) => other.stage === stage && other.fault)) { this.remove(mark); }
    for (const {text, fault, place} of faults) {
      if (place) { this.mark(stage, new THREE.Vector3(...place), text, [], fault); }
    }
    this.setStatus(words);
  }

  // fault: the whole fault if the mark shows one, otherwise empty.
  mark(stage, point, text, way, fault = '') {
    const group = new THREE.Group(), radius = (fault ? 0.008 : 0.004) * this.box.getSize(new THREE.Vector3()).length();
    const material = new THREE.MeshBasicMaterial({color: fault ? 0xd00000 : 0x0b5c8f, depthTest: false,
      transparent: true});  // drawn after translucent faces
    for (const end of way.length ? [way[0], way[way.length - 1]] : [point]) {
      const ball = new THREE.Mesh(new THREE.SphereBufferGeometry(radius, 12, 8), material);
      ball.position.copy(end);
      group.add(ball);
    }
    if (way.length > 1) {
      const line = new THREE.BufferGeometry().setFromPoints(way);
      group.add(new THREE.Line(line, new THREE.LineBasicMaterial({color: 0x0b5c8f, depthTest: false})));
    }
    group.renderOrder = 1000;
    const label = document.createElement('div');
    label.className = fault ? 'view3d-label fault' : 'view3d-label';
    label.title = fault;
    const close = Object.assign(document.createElement('button'), {type: 'button', textContent: '\u00d7'});
    close.setAttribute('aria-label', `remove ${text}`);
    label.append(text, close);
    const made = {stage, point: point.clone(), group, label, text, fault};
    close.addEventListener('click', () => this.remove(made));
    stage.extra.add(group);
    stage.overlay.append(label);
    this.marks.push(made);
    this.setStatus(text);
    this.draw();
  }

  remove(mark) {
    mark.stage.extra.remove(mark.group);
    mark.label.remove();
    this.marks = this.marks.filter((other) => other !== mark);
    this.draw();
  }

  placeLabels(stage) {
    const camera = stage.shared.camera.camera, width = stage.canvas.clientWidth, height = stage.canvas.clientHeight;
    for (const mark of this.marks.filter((other) => other.stage === stage)) {
      const at = mark.point.clone().project(camera);
      mark.label.style.left = `${(at.x + 1) / 2 * width}px`;
      mark.label.style.top = `${(1 - at.y) / 2 * height}px`;
      mark.label.hidden = Math.abs(at.x) > 1 || Math.abs(at.y) > 1;
    }
  }

  setStatus(words) { if (this.status) { this.status.textContent = words; } }

  setTool(tool) {
    this.tool = this.tool === tool ? 'none' : tool;
    this.pending = null;
    for (const [name, button] of this.buttons) { button.setAttribute('aria-pressed', String(name === this.tool)); }
    this.setStatus({none: '', distance: 'Click two points of one surface.', depth: 'Click on bone.',
              label: 'Write a label, then click where it belongs.'}[this.tool]);
  }

  applyClip() {
    const normals = {left: [1, 0, 0], back: [0, 1, 0], up: [0, 0, 1]}, normal = normals[this.clip.axis];
    const planes = [];
    if (normal) {
      const n = new THREE.Vector3(...normal), low = n.dot(this.box.min), high = n.dot(this.box.max);
      const sign = this.clip.flipped ? -1 : 1, at = low + (high - low) * this.clip.at;
      planes.push(new THREE.Plane(n.multiplyScalar(sign), -sign * at));
    }
    for (const stage of this.stages) { stage.renderer.clippingPlanes = planes; }
    this.draw();
  }

  // The controls, as elements for any panel.
  controls(fullScreenOf) {
    const made = (tag, properties, ...children) => {
      const node = Object.assign(document.createElement(tag), properties);
      node.append(...children);
      return node;
    };
    this.buttons = new Map();
    const tool = (name, text) => {
      const button = made('button', {type: 'button', textContent: text});
      button.setAttribute('aria-pressed', 'false');
      button.dataset.tool = name;
      button.addEventListener('click', () => this.setTool(name));
      this.buttons.set(name, button);
      return button;
    };
    this.text = made('input', {type: 'text', placeholder: 'label', maxLength: 80, size: 12});
    this.text.setAttribute('aria-label', 'text of the next label');
    this.status = made('p', {className: 'view3d-status'});
    this.status.setAttribute('role', 'status');
    const axis = made('select', {}, ...[['none', 'no cut'], ['left', 'from the side'], ['back', 'from the front'],
                                        ['up', 'from below']].map(([value, textContent]) => made('option', {value, textContent})));
    const slider = made('input', {type: 'range', min: 0, max: 1, step: 0.005, value: 0.5});
    slider.setAttribute('aria-label', 'where the cut lies');
    const flip = made('input', {type: 'checkbox'});
    axis.addEventListener('change', () => { this.clip.axis = axis.value; this.applyClip(); });
    slider.addEventListener('input', () => { this.clip.at = Number(slider.value); this.applyClip(); });
    flip.addEventListener('change', () => { this.clip.flipped = flip.checked; this.applyClip(); });
    const clear = made('button', {type: 'button', textContent: 'Clear'});
    clear.addEventListener('click', () => { for (const mark of [...this.marks]) { this.remove(mark); } this.setStatus(''); });
    const full = made('button', {type: 'button', textContent: 'Full screen'});
    full.addEventListener('click', () => {
      if (document.fullscreenElement) { document.exitFullscreen(); } else { fullScreenOf.requestFullscreen(); }
    });
    const hasBone = this.stages.some((stage) => !stage.description.axes);  // only scenes of heads have bone
    return [made('div', {className: 'view3d-buttons'}, tool('distance', 'Distance'), hasBone ? tool('depth', 'Depth') : '',
                 tool('label', 'Pin'), clear, full),
            made('label', {className: 'view3d-choice'}, 'label ', this.text), this.status,
            made('label', {className: 'view3d-choice'}, 'cut ', axis), slider,
            made('label', {className: 'view3d-choice'}, 'other half ', flip), this.section.element];
  }
}
