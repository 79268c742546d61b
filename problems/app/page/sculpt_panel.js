// SPDX-License-Identifier: GPL-3.0-or-later
// Editing the face by hand: a point of it is dragged, or held and pulled by buttons and keys, at the chosen level; brushes
// smooth, inflate and flatten it. Every pull and every touch of a brush is an edit of control vertices in edits.yaml, which `semblance edit` and `semblance run` replay.
import {button, check, element, field, group, select} from './dom.js';
import {get, post} from './api.js';
import {act, showMessage, store} from './store.js';

const MAX_DRAG_MM = 60;
// A normal whose projection on the view is shorter than this points nearly at the viewer. A drag up or down then pulls
// along it, because dividing by the short projection would make the pull much longer than the drag.
const FACING = 0.35;
const TOOLS = [['pull', 'Pull'], ['smooth', 'Smooth'], ['inflate', 'Inflate'], ['deflate', 'Deflate'], ['flatten', 'Flatten']];
const TOUCH_EVERY_PX = 14;  // distance of a brush's touches along a stroke
const KEYS = {o: 'out', i: 'in', a: 'left', d: 'right', w: 'up', s: 'down'};

// Size of a pixel of the canvas in mm at a point.
const pixelSize = (stage, point) => {
  const {camera} = stage.shared.camera;
  return 2 * camera.position.distanceTo(point) * Math.tan(camera.fov * Math.PI / 360) / stage.canvas.clientHeight;
};

// Unit vectors to the right and up in the view.
const viewAxes = (stage) => {
  const axes = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()];
  stage.shared.camera.camera.matrixWorld.extractBasis(...axes);
  return {right: axes[0], up: axes[1]};
};

// The pull in mm for a pointer that moved by pixels to the right and down.
const pullOf = (stage, held, mode, right, down) => {
  const size = pixelSize(stage, held.point), axes = viewAxes(stage);
  if (mode === 'view') {
    return axes.right.multiplyScalar(right * size).addScaledVector(axes.up, -down * size).clampLength(0, MAX_DRAG_MM);
  }
  const across = held.normal.dot(axes.right), upwards = held.normal.dot(axes.up), seen = Math.hypot(across, upwards);
  const by = seen > FACING ? (right * across - down * upwards) * size / (seen * seen) : -down * size;
  return held.normal.clone().multiplyScalar(Math.max(-MAX_DRAG_MM, Math.min(MAX_DRAG_MM, by)));
};

// The face while a point of it is dragged. The program computes the displacement of each vertex per millimetre of the
// pull; the page adds them up. At release the program makes the real pull.
class PullPreview {
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

export function sculptPanel({scene, faces}) {
  const options = {level: 2, reach: 2, mirror: true}, stage = scene.main.stage;
  let held = null;  // {point, normal} on the face

  const words = element('p'), count = element('p', {className: 'soft'});
  const level = element('input', {type: 'range', min: 0, max: 3, step: 1, value: options.level,
                                  oninput: () => { options.level = Number(level.value); levelWords.textContent = level.value; }});
  const levelWords = element('output', {textContent: String(options.level)});
  const reach = element('input', {type: 'range', min: 1, max: 6, step: 0.5, value: options.reach, oninput: () => { options.reach = Number(reach.value); }});
  const mirror = element('input', {type: 'checkbox', checked: true, onchange: () => { options.mirror = mirror.checked; }});
  const distance = element('input', {type: 'number', value: 2, min: 0.1, max: 30, step: 0.5});
  const drags = element('input', {type: 'checkbox', checked: true});
  const mode = select([['normal', 'along the normal'], ['view', 'in the plane of the view']], 'normal', () => {});
  mode.dataset.control = 'drag-mode';
  let tool = 'pull';
  const tools = element('div', {className: 'row'}, ...TOOLS.map(([name, text]) => button(text, () => setTool(name), {dataset: {tool: name}})));
  const setTool = (name) => {
    tool = name;
    for (const made of tools.children) { made.setAttribute('aria-pressed', String(made.dataset.tool === tool)); }
    brushRow.hidden = tool === 'pull';
  };
  const strength = element('input', {type: 'range', min: 0.1, max: 1, step: 0.1, value: 0.5});
  const brushRow = element('div', {hidden: true}, field('strength', strength, 'a click touches the face once, a stroke several times; inflate and deflate: in mm'));
  // The arguments of a touch of the brush at a point.
  const touchOf = (point) => ({at: point.toArray(), ...options, kind: tool === 'deflate' ? 'inflate' : tool,
                               strength: Number(strength.value) * (tool === 'deflate' ? -1 : 1)});
  const way = element('p', {className: 'soft', role: 'status'});
  const library = element('div');

  const hold = (point) => {
    held = point;
    scene.putArrow(held && held.point, held && held.point.clone().addScaledVector(held.normal, 12));
    for (const made of Object.values(ways)) { made.disabled = !held; }
  };
  const pull = async (by) => {
    const done = await act('pull', {at: held.point.toArray(), by: by.toArray(), ...options});
    if (done && held) { hold({point: held.point.clone().add(by), normal: held.normal}); }
    return done;
  };
  const step = (name) => {
    if (!held) { return null; }
    const mm = Number(distance.value), {right, up} = viewAxes(stage);
    const by = {out: () => held.normal.clone().multiplyScalar(mm), in: () => held.normal.clone().multiplyScalar(-mm),
                left: () => right.multiplyScalar(-mm), right: () => right.multiplyScalar(mm),
                up: () => up.multiplyScalar(mm), down: () => up.multiplyScalar(-mm)}[name]();
    return pull(by);
  };
  const wayButton = (name, text, key) => button(text, () => step(name), {disabled: true, title: `${text} (${key.toUpperCase()})`, dataset: {pull: name}});
  const ways = {out: wayButton('out', 'Pull out', 'o'), in: wayButton('in', 'Push in', 'i'), left: wayButton('left', '\u2190', 'a'),
                right: wayButton('right', '\u2192', 'd'), up: wayButton('up', '\u2191', 'w'), down: wayButton('down', '\u2193', 's')};
  for (const [name, text] of [['left', 'pull to the left of the view'], ['right', 'pull to the right of the view'], ['up', 'pull upwards in the view'], ['down', 'pull downwards in the view']]) {
    ways[name].setAttribute('aria-label', text);
  }

  const pointAt = (event) => {
    const hit = stage.hit(event, ['face']);
    return hit && {point: hit.point.clone(), normal: hit.face.normal.clone().normalize()};
  };
  const holdMiddle = () => {
    const box = stage.canvas.getBoundingClientRect();
    const found = pointAt({clientX: box.left + box.width / 2, clientY: box.top + box.height / 2});
    hold(found);
    way.textContent = found ? 'The point in the middle of the view is held.' : 'No point of the face is in the middle of the view.';
  };

  const touchMiddle = () => {
    holdMiddle();
    if (held && tool !== 'pull') { act('brush', touchOf(held.point)); }
  };

  // A stroke of a brush. A touch waits until the face of the one before has arrived.
  const stroke = (event, first) => {
    let at = event, busy = false;
    const touch = async (point) => {
      busy = true;
      await act('brush', touchOf(point));
      busy = false;
    };
    touch(first.point);
    const move = (next) => {
      if (busy || faces.busy || Math.hypot(next.clientX - at.clientX, next.clientY - at.clientY) < TOUCH_EVERY_PX) { return; }
      const found = pointAt(next);
      if (!found) { return; }
      at = next;
      touch(found.point);
    };
    return {move, end: () => {}, cancel: () => {}};
  };

  // Handles a press on the face for Scene.onDrag; null for a press elsewhere.
  const grip = (event) => {
    const found = drags.checked && store.state.face.fresh && faces.kind === 'full' && pointAt(event);
    if (!found) { return null; }
    if (tool !== 'pull') { return stroke(event, found); }
    const start = {x: event.clientX, y: event.clientY};
    let preview = null, by = null;
    const showLength = () => { way.textContent = `${by.length().toFixed(1)} mm`; };
    return {
      move: (next, still) => {
        if (still) { return; }
        if (!preview) {
          hold(null);
          preview = new PullPreview(scene, found.point, options);
        }
        by = pullOf(stage, found, mode.value, next.clientX - start.x, next.clientY - start.y);
        scene.putArrow(found.point, found.point.clone().add(by));
        preview.show(by);
        showLength();
      },
      end: async () => {
        hold(found);
        if (!preview) { way.textContent = ''; return; }
        if (!(by.length() > 0.05) || !await pull(by)) { preview.restore(); }
        preview.stop();
      },
      cancel: () => {
        if (preview) { preview.restore(); preview.stop(); }
        way.textContent = 'Nothing was pulled.';
        hold(null);
      }
    };
  };
  const pick = (hitOf) => {
    const hit = hitOf(['face']);
    hold(hit ? {point: hit.point, normal: hit.face.normal.clone()} : null);
  };

  const drawLibrary = async () => {
    store.files = await get('files');
    const {parts, features} = store.files;
    const part = element('select', {}, ...parts.map((name) => element('option', {value: name, textContent: name.replaceAll('_', ' ')})));
    const name = element('input', {type: 'text', placeholder: 'name', maxLength: 60});
    part.setAttribute('aria-label', 'part of the face');
    name.setAttribute('aria-label', 'name of the feature');
    const keep = button('Keep', async () => {
      if (await act('keep_feature', {part: part.value, name: name.value.trim()})) { drawLibrary(); }
    });
    library.replaceChildren(group('Features',
        element('div', {className: 'row'}, part, name, keep),
        element('small', {className: 'doc', textContent: 'Stores the detail of a part in features/; the slider blends a stored feature into this face.'}),
        ...features.map((feature) => field(feature, element('input', {type: 'range', min: 0, max: 1, step: 0.05, value: 0,
            onchange: (event) => act('blend_feature', {name: feature, weight: Number(event.target.value)})})))));
  };

  setTool('pull');
  const root = element('div', {}, words,
      group('Tool', tools, brushRow,
            field('level', element('span', {className: 'row'}, level, levelWords), 'a coarse level moves a large part of the face, a fine one a small part'),
            field('reach', reach), check('Both sides', mirror),
            check('A drag on the face pulls it', drags), field('a drag pulls', mode, 'if the normal points at you, up pulls out'), way),
      group('By buttons and keys',
            button('Touch the middle with the brush', touchMiddle, {title: 'B', dataset: {pull: 'touch'}}),
            button('Hold the point in the middle', holdMiddle, {title: 'H', dataset: {pull: 'hold'}}),
            field('distance (mm)', distance), element('div', {className: 'row'}, ways.out, ways.in),
            element('div', {className: 'row'}, ways.left, ways.right, ways.up, ways.down),
            element('small', {className: 'doc', textContent: 'B touches the middle of the view with the brush. H holds the point there, O and I pull it out and push it in, W A S D move it in the plane of the view; Escape releases it.'})),
      library, count, button('Remove all edits', () => act('clear_edits')));

  document.addEventListener('keydown', (event) => {
    const types = ['INPUT', 'SELECT', 'TEXTAREA'].includes(event.target.tagName) && event.target.type !== 'range' && event.target.type !== 'checkbox';
    if (!root.isConnected || types || event.ctrlKey || event.altKey || event.metaKey || !store.state.face.fresh) { return; }
    const key = event.key.toLowerCase();
    if (key === 'h') { holdMiddle(); }
    if (key === 'b') { touchMiddle(); }
    if (KEYS[key]) { step(KEYS[key]); }
    if (event.key === 'Escape' && held) { hold(null); }
  });

  const state = (now) => {
    const ready = now.face.fresh;
    words.textContent = ready ? 'Drag a point of the face to pull it; a drag beside the face turns the head. A click holds a point for the buttons.'
                              : 'Sculpting needs the full face of the present options: make it first (the button at the top).';
    for (const control of root.querySelectorAll('input, select, fieldset button')) {
      if (!Object.values(ways).includes(control)) { control.disabled = !ready; }
    }
    count.textContent = now.edited_vertices ? `${now.edited_vertices} control vertices are edited.` : 'No control vertex is edited.';
    if (faces.finest) {  // the face may have fewer levels than the chosen one
      level.max = faces.finest;
      options.level = Number(level.value);
      levelWords.textContent = level.value;
    }
  };
  return {
    element: root,
    state,
    show: () => {
      scene.onPick = pick;
      scene.onDrag = grip;
      drawLibrary().catch((error) => showMessage(error.message)).then(() => state(store.state));
    },
    hide: () => { scene.onPick = null; scene.onDrag = null; hold(null); }
  };
}
