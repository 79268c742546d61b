// SPDX-License-Identifier: GPL-3.0-or-later
// The 3-D view of a report: canvases with one common camera, and the panel that controls them.
'use strict';
(() => {
  const root = document.getElementById('view3d');
  // Points to the alternative: the page of a run has pictures, the page of a study does not.
  const instead = () => document.querySelector('figure img') ? 'The pictures on this page show the same from fixed sides.'
                                                             : 'The rest of this page does not need it.';
  if (!SemblanceGuides.canShow()) {
    const words = document.createElement('p');
    words.className = 'no-view';
    words.textContent = 'There is no 3-D view here, because WebGL is off in this browser or not available on this machine. '
        + instead();
    root.replaceChildren(words);
    return;
  }
  const {scenes, blobs} = JSON.parse(document.getElementById('view3d-scenes').textContent);
  const element = (tag, properties, ...children) => {
    const made = Object.assign(document.createElement(tag), properties);
    made.append(...children);
    return made;
  };

  // The first view shows the head, or else the face, translucent, over bone and depth markers.
  const headed = scenes.every((scene) => scene.layers.some((layer) => layer.id === 'bust'));
  const SHOWN = headed ? ['skull', 'dowels', 'bust'] : ['skull', 'dowels', 'face'];
  const OPACITY = {face: 0.6, implicit: 0.6, skin: 0.5};
  const shared = {layers: new Map(), mapped: false, range_mm: 8, exaggeration: 1, difference: false, camera: null};
  const labels = new Map();
  for (const layer of scenes.flatMap((scene) => scene.layers)) {
    labels.set(layer.id, layer);
    shared.layers.set(layer.id, {shown: layer.shown || SHOWN.includes(layer.id), opacity: OPACITY[layer.id] || 1});
  }

  const stages = [];
  let measure = null;
  const pace = new SemblancePace(() => stages, () => drawCompass());
  const drawSoon = shared.drawSoon = () => pace.soon();
  const updateAll = () => {
    for (const stage of stages) { stage.update(); }
    drawLegends();
  };

  // Colours each face by its distance outside the other view's face. Shows the faces and hides the heads over them.
  const showDifference = () => {
    const faces = stages.map((stage) => stage.layers && stage.layers.get('face'));
    if (!shared.difference || faces.length < 2 || !faces.every(Boolean)) { return; }
    const reach_mm = 20, geometries = faces.map(({object}) => object.geometry);
    faces.forEach(({object}, n) => {
      object.userData.difference = SemblanceGeometry.outsideOf(geometries[n], geometries[1 - n], reach_mm);
    });
    for (const [id, shown] of [['bust', false], ['face', true]]) {
      const state = shared.layers.get(id), box = document.querySelector(`input[data-layer="${id}"]`);
      if (state) { state.shown = shown; }
      if (box) { box.checked = shown; }
    }
    shared.layers.get('face').opacity = 1;
    updateAll();
  };

  // Canvases: two if there are scenes to compare.
  const frames = element('div', {className: 'view3d-frames'});
  const makeFrame = (name, first) => {
    const canvas = element('canvas', {tabIndex: 0});
    canvas.setAttribute('aria-label', `3-D view ${name}; arrow keys turn it`);
    const tip = element('div', {className: 'view3d-tip', hidden: true});
    const facts = element('div', {className: 'view3d-facts'});
    const choice = element('select', {},
        ...scenes.map((scene, n) => element('option', {value: n, textContent: scene.label, selected: n === first})));
    const head = element('label', {className: 'view3d-head'}, scenes.length > 1 ? `${name} ` : '',
        scenes.length > 1 ? choice : scenes[0].label);
    frames.append(element('div', {className: 'view3d-frame'}, head, facts,
                          element('div', {className: 'view3d-stage'}, canvas, tip)));
    const stage = new SemblanceStage(canvas, tip, shared);
    const show = () => {
      const scene = scenes[Number(choice.value)];
      facts.textContent = scene.facts.join(' \u00b7 ');
      facts.classList.toggle('fault', (scene.faults || []).length > 0);
      stage.show(scene, blobs);
      if (measure) { measure.markFaults(stage, scene.faults || []); }
      showDifference();
    };
    choice.addEventListener('change', show);
    return {stage, canvas, show};
  };

  // Panel.
  const panel = element('div', {className: 'view3d-panel'});
  const button = (text, title, act) => {
    const made = element('button', {type: 'button', textContent: text, title});
    made.addEventListener('click', act);
    return made;
  };
  const group = (title, ...children) =>
      element('fieldset', {}, element('legend', {textContent: title}), ...children);
  const select = (label, values, chosen, act) => {
    const made = element('select', {}, ...values.map(([value, text]) =>
        element('option', {value, textContent: text, selected: value === chosen})));
    made.addEventListener('change', () => { act(made.value); updateAll(); });
    return element('label', {className: 'view3d-choice'}, `${label} `, made);
  };

  const layerRow = (id, layer) => {
    const state = shared.layers.get(id);
    const box = element('input', {type: 'checkbox', checked: state.shown});
    box.dataset.layer = id;
    box.addEventListener('change', () => { state.shown = box.checked; updateAll(); });
    const row = element('div', {className: 'view3d-layer'},
        element('label', {}, box, element('i', {style: `background:${layer.colour}`}), layer.label));
    if (layer.mesh) {
      const slider = element('input', {type: 'range', min: 0.1, max: 1, step: 0.05, value: state.opacity, title: 'opacity'});
      slider.setAttribute('aria-label', `opacity of ${layer.label}`);
      slider.addEventListener('input', () => { state.opacity = Number(slider.value); updateAll(); });
      row.append(slider);
    }
    return row;
  };

  const savePicture = () => {
    stages.forEach((stage, n) => {
      stage.draw();
      element('a', {href: stage.canvas.toDataURL('image/png'), download: `view-${'AB'[n]}.png`}).click();
    });
  };

  const compass = element('canvas', {className: 'view3d-compass', width: 224, height: 224});
  const legends = element('div', {className: 'view3d-legends'});

  const drawCompass = () => SemblanceGuides.drawCompass(compass, shared.camera.camera, scenes[0].axes);
  const legendOf = (map) => SemblanceGuides.legendOf(map, shared.range_mm);

  // A legend for each visible map.
  const drawLegends = () => {
    const used = new Set();
    for (const [id, layer] of labels) {
      if (shared.difference && layer.map === 'error') { continue; }
      if (layer.map && shared.layers.get(id).shown && (layer.always_mapped || shared.mapped)) { used.add(layer.map); }
    }
    const maps = [...used].map((name) => scenes[0].maps[name]);
    if (shared.difference) { maps.push({...scenes[0].maps.error, title: 'outside (+) or inside (\u2212) of the other view\'s face'}); }
    legends.replaceChildren(...maps.map(legendOf));
  };

  const canDiffer = scenes.length > 1 && scenes.every((scene) => scene.maps.error && scene.layers.some((layer) => layer.id === 'face'));
  const hasDowels = [...labels.values()].some((layer) => layer.dowels);
  const hasError = [...labels.values()].some((layer) => layer.map === 'error');
  const faceViews = scenes[0].axes ? [['Oblique', 35, 35], ['Front', 0, 0], ['Left', 90, 0], ['Right', -90, 0], ['Back', 180, 0],
                                      ['Top', 0, 89]] : [['Front', 0, 0], ['Three-quarter', 35, 8], ['Left side', 90, 0], ['Right side', -90, 0],
                     ['Back', 180, 0], ['Top', 0, 89]];
  panel.append(
      group('Look from', element('div', {className: 'view3d-buttons'}, ...faceViews.map(([name, turn, rise]) =>
          button(name, `look from ${name.toLowerCase()}`, () => shared.camera.look(turn, rise))))),
      group('Show', ...[...labels].map(([id, layer]) => layerRow(id, layer))),
      ...(hasError || hasDowels ? [group('Colours',
            ...(hasError || canDiffer ? [
              select('faces by', [['skin', 'plain'], ...(hasError ? [['error', 'signed error']] : []),
                                  ...(canDiffer ? [['difference', 'difference of A and B']] : [])], 'skin', (value) => {
                shared.mapped = value === 'error';
                shared.difference = value === 'difference';
                showDifference();
              }),
              select('error up to', [[2, '\u00b1 2 mm'], [4, '\u00b1 4 mm'], [8, '\u00b1 8 mm'], [16, '\u00b1 16 mm']], 8,
                     (value) => { shared.range_mm = Number(value); })] : []),
            ...(hasDowels ? [
              select('face off markers', [[1, 'true length'], [5, '5 times'], [10, '10 times']], 1,
                     (value) => { shared.exaggeration = Number(value); })] : []))] : []),
      legends, compass, button('Save picture', 'as PNG', savePicture));
  const touch = matchMedia('(pointer: coarse)').matches;
  const hint = element('p', {className: 'view3d-hint', textContent: touch
      ? 'One finger sideways turns, two fingers turn, shift and zoom; up and down scrolls the page. Touch a surface to read its value.'
      : 'Drag to turn, shift and drag to move; after a click, or with Ctrl, the wheel zooms. Point at a surface or a marker to read its value.'});
  root.replaceChildren(element('div', {}, frames, hint), panel);

  try {
    const made = [makeFrame('A', 0)];
    if (scenes.length > 1) { made.push(makeFrame('B', 1)); }
    const box = new THREE.Box3();
    for (const id of new Set(scenes[0].layers.filter((layer) => layer.mesh).map((layer) => layer.mesh))) {
      const geometry = SemblanceGeometry.geometryOf(blobs[id]);
      geometry.computeBoundingBox();
      box.union(geometry.boundingBox);
    }
    shared.camera = new SemblanceCamera(box, drawSoon);
    if (scenes[0].axes) { shared.camera.reach = 2.6; }  // a surface fills its box, a head does not
    for (const {stage, canvas, show} of made) {
      stages.push(stage);
      show();
      shared.camera.attach(canvas, {wheel: 'asked'});
    }
    measure = new SemblanceMeasure(stages, drawSoon, box);
    for (const stage of stages) { measure.markFaults(stage, stage.description.faults || []); }
    panel.insertBefore(group('Measure', ...measure.controls(root)), legends);
    drawLegends();
    shared.camera.look(35, scenes[0].axes ? 35 : 8);
    new ResizeObserver(drawSoon).observe(frames);
  } catch (error) {
    root.replaceChildren(element('p', {className: 'no-view',
      textContent: `The 3-D view could not start (${error.message}). ${instead()}`}));
  }
})();
