// SPDX-License-Identifier: GPL-3.0-or-later
// A look into a volume before its surfaces are extracted: its series with a preview each, and slices on which the bone is
// tinted as the threshold finds it.
import {get} from './api.js';
import {button, element, field} from './dom.js';

const PLANES = [['axial', 'axial, from below'], ['coronal', 'coronal, from the front'], ['sagittal', 'sagittal']];
const MOST_PREVIEWS = 12;
const addressOf = (query) => `api/slice.png?${new URLSearchParams(query)}`;

// A picture whose next address waits until the present one has arrived.
function picture(alt) {
  const made = element('img', {alt, className: 'slice'});
  let next = null, loads = false;
  const load = (address) => {
    if (loads) { next = address; return; }
    loads = true;
    made.src = address;
  };
  const arrived = () => {
    loads = false;
    const address = next;
    next = null;
    if (address) { load(address); }
  };
  made.addEventListener('load', arrived);
  made.addEventListener('error', arrived);
  return {made, load};
}

function slices(source, thresholds) {
  const views = PLANES.map(([plane, title]) => {
    const {made, load} = picture(`${title} slice`);
    const place = element('input', {type: 'range', min: 0, max: 1, step: 0.01, value: 0.5, oninput: () => draw()});
    place.setAttribute('aria-label', `place of the ${plane} slice`);
    const draw = () => {
      const {bone_hu, skin_hu} = thresholds();
      load(addressOf({...source(), plane, at: place.value, bone_hu, skin_hu, side: 300}));
    };
    return {draw, made: element('figure', {dataset: {plane}}, made, place, element('figcaption', {textContent: title}))};
  });
  return {draw: () => views.forEach(({draw}) => draw()), made: element('div', {className: 'slices'}, ...views.map(({made}) => made))};
}

// Loads the previews of series one after the other, because the program reads a whole series for each.
async function loadPreviews(list) {
  for (const image of [...list.querySelectorAll('img.preview')].slice(0, MOST_PREVIEWS)) {
    if (!list.isConnected) { return; }
    await new Promise((next) => {
      image.addEventListener('load', next);
      image.addEventListener('error', () => { image.remove(); next(); });
      image.src = image.dataset.address;
    });
  }
}

// path: of the volume. options: the options for reading it, which this element changes: {series, import: {bone_hu}}.
export function volumeLook(path, options, usual, changed) {
  const note = element('p', {className: 'soft', role: 'status', textContent: 'Reading the volume \u2026'}), list = element('div', {className: 'series'}), body = element('div');
  const source = () => ({path, ...(options.series ? {series: options.series} : {}), ...(options.fill_slices ? {fill: 'true'} : {})});
  const bone = () => options.import?.bone_hu ?? usual.bone_hu, skin = () => options.import?.skin_hu ?? usual.skin_hu;
  const threshold = element('input', {type: 'range', min: 100, max: 800, step: 10, value: bone()}), shown = element('output', {textContent: `${bone()} HU`});
  const view = slices(source, () => ({bone_hu: bone(), skin_hu: skin()}));
  threshold.dataset.control = 'bone_hu';
  threshold.addEventListener('input', () => {
    options.import = {...options.import, bone_hu: Number(threshold.value)};
    shown.textContent = `${threshold.value} HU`;
    view.draw();
  });
  threshold.addEventListener('change', changed);

  const look = async () => {
    note.textContent = 'Reading the volume \u2026';
    body.replaceChildren();
    try {
      const found = await get('volume', source());
      note.textContent = found.is_mr ? 'An MR shows no bone; it can give the skin of this head.' : 'Orange: what becomes the skull. Blue: the border of the skin.';
      body.replaceChildren(view.made, found.is_mr ? '' : field('bone from', element('span', {className: 'row'}, threshold, shown),
          'lower: thin walls stay, but soft tissue and noise come too; higher: the bone gets thinner and opens'));
      view.draw();
    } catch (error) {
      note.textContent = error.message;
    }
  };

  const choose = (name) => {
    options.series = name;
    for (const made of list.children) { made.setAttribute('aria-pressed', String(made.dataset.series === name)); }
    changed();
    return look();
  };
  const begin = async () => {
    try {
      const all = await get('series', {path});
      if (all.length > 1) {
        note.textContent = 'Choose the series of the head.';
        list.replaceChildren(...all.map(({name, description, modality, slices: count, columns, rows}) => {
          const made = button('', () => choose(name), {dataset: {series: name}});
          made.append(element('img', {alt: '', className: 'preview', dataset: {address: addressOf({path, series: name, plane: 'sagittal', at: 0.5, side: 80})}}), element('span', {textContent: `${description || 'no description'} (${name})`}), element('small', {textContent: `${modality}, ${count} slices of ${columns} \u00d7 ${rows}`}));
          return made;
        }));
        if (options.series) { await choose(options.series); }
        loadPreviews(list);
        return;
      }
    } catch { /* the volume itself states the fault */ }
    await look();
  };
  begin();
  return element('div', {className: 'volume-look'}, list, note, body);
}
