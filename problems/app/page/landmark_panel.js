// SPDX-License-Identifier: GPL-3.0-or-later
// Landmarks: a list of the sites, details of the chosen site, and clicks on the bone.
import {dowelHandle} from './dowel_handle.js';
import {button, element, field, lines, millimetres, select} from './dom.js';
import {chooser} from './opener.js';
import {act, choose, download, landmarkOf, nameOf, onChoice, siteOf, store} from './store.js';

const FORMATS = [['.yaml', 'YAML (Semblance)'], ['.mrk.json', '3D Slicer (.mrk.json)'], ['.fcsv', '3D Slicer (.fcsv)'],
                 ['.pp', 'MeshLab (.pp)'], ['.csv', 'table (.csv)'], ['.txt', 'CloudCompare (.txt)']];
const DOUBTFUL = {from_bone_mm: 2, from_mirror_mm: 8, from_predicted_mm: 15};
const MEANINGS = {from_bone_mm: 'from the bone', from_mirror_mm: 'from the mirror image of its partner',
                  from_predicted_mm: 'from the prediction by the others'};

const standardSites = () => store.sites.filter((site) => site.standard);
const isAbsent = (code) => store.state.absent.some((absent) => absent.site === code);

// The next site after `code` that is neither placed nor absent; null when there is none.
const nextOpen = (code) => {
  const codes = standardSites().map((site) => site.site), at = codes.indexOf(code);
  return [...codes.slice(at + 1), ...codes.slice(0, at + 1)].find((other) => !landmarkOf(other) && !isAbsent(other)) || null;
};

// The proposed points, the most doubtful first; one without a doubt comes before all.
const toReview = () => store.state.landmarks.filter((landmark) => landmark.proposed)
    .sort((a, b) => (b.doubt_mm ?? Infinity) - (a.doubt_mm ?? Infinity));

// The first three clicks determine the pose; the program suggests the rest from them.
const FIRST_CLICKS = ['n', 'zy_l', 'zy_r'];
const nextStep = () => FIRST_CLICKS.find((code) => !landmarkOf(code) && !isAbsent(code)) || null;

const doubts = (landmark) =>
    Object.keys(DOUBTFUL).filter((check) => landmark[check] !== null && landmark[check] > DOUBTFUL[check]);

const doubtText = ({doubt_mm, doubtful}) =>
    `${doubtful ? 'doubtful' : 'check it'}${doubt_mm === null ? '' : `: may be off by ${millimetres(doubt_mm)}`}`;

function row(site) {
  const landmark = landmarkOf(site.site), absent = isAbsent(site.site);
  const mark = landmark ? (landmark.proposed ? '\u25cc' : '\u25cf') : absent ? '\u2013' : '\u25cb';
  const words = landmark ? (landmark.proposed ? doubtText(landmark) : doubts(landmark).length ? 'check again' : '')
                         : absent ? 'absent' : '';
  const made = button('', () => choose(site.site), {className: 'site', dataset: {site: site.site}});
  made.setAttribute('aria-pressed', String(store.site === site.site));
  made.append(element('i', {textContent: mark, className: landmark && doubts(landmark).length ? 'bad' : ''}),
              element('span', {textContent: nameOf(site.site)}), element('code', {textContent: site.site}),
              element('small', {textContent: words}));
  return made;
}

let remarksOpen = false;  // stays the same for the next site

function remarks(landmark) {
  const change = (what) => act('remark', {site: landmark.site, certainty: landmark.certainty, note: landmark.note,
                                          depth_mm: landmark.depth_along_normal_mm, ...what});
  return element('details', {open: remarksOpen, ontoggle: (event) => { remarksOpen = event.target.open; }},
      element('summary', {textContent: 'Remarks'}),
      field('certainty', select([['high', 'high'], ['medium', 'medium'], ['low', 'low']], landmark.certainty,
                                (certainty) => change({certainty}))),
      field('depth measured here (mm)', element('input', {type: 'number', min: 0.01, max: 100, step: 0.1,
          value: landmark.depth_along_normal_mm ?? '',
          onchange: (event) => change({depth_mm: event.target.value === '' ? null : Number(event.target.value)})}),
          'used if "depths from" is "measured"'),
      field('note', element('input', {type: 'text', maxLength: 300, value: landmark.note,
                                      onchange: (event) => change({note: event.target.value})})));
}

// One image per site, kept so that other changes do not make it flicker.
const pictures = new Map();
const pictureOf = (code) => {
  if (!pictures.has(code)) {
    pictures.set(code, element('img', {src: `api/site.png?${new URLSearchParams({site: code})}`, width: 440, height: 260,
                                       alt: `position of ${nameOf(code)} on a phantom skull, from the front and from the side`,
                                       title: 'a phantom skull; a ring marks a point behind the bone'}));
  }
  return pictures.get(code);
};

// The picture is loaded when the details are opened for the first time.
const allSites = element('details', {ontoggle: () => {
  if (allSites.open && allSites.children.length === 1) {
    allSites.append(element('img', {src: 'api/sites.svg', alt: 'the sites on a phantom skull, by number'}));
  }
}}, element('summary', {textContent: 'All sites by number'}));

// Confirms a point and goes on to the next one to review.
async function confirm(code) {
  if (await act('confirm', {site: code}) && toReview().length) { choose(toReview()[0].site); }
}

function detail(code, handle) {
  if (!code) {
    return [element('p', {className: 'soft', textContent: 'Choose a site, then click on the bone. Click on a ball to choose its site; drag a ball to move it. Keys: P places the site in the middle of the view, W A S D move it by 1 mm (with Shift 0.2 mm), I J K L turn its dowel by 3\u00b0 (with Shift 1\u00b0), Enter confirms it, N goes to the next, Delete removes it.'})];
  }
  const site = siteOf(code), landmark = landmarkOf(code);
  const direction = element('p', {className: 'soft direction', textContent: landmark ? handle.words() : ''});
  const checks = landmark ? Object.keys(MEANINGS).filter((check) => landmark[check] !== null && landmark[check] !== undefined)
      .map((check) => element('li', {className: landmark[check] > DOUBTFUL[check] ? 'bad' : ''},
          element('strong', {textContent: millimetres(landmark[check])}), ` ${MEANINGS[check]}`)) : [];
  const names = store.sites.map((other) => [other.site, `${other.site}: ${nameOf(other.site)}`]);
  return [
    element('h2', {textContent: nameOf(code)}),
    element('div', {className: 'site-place'}, element('p', {textContent: `${site.definition}.`}), pictureOf(code)),
    landmark && landmark.proposed ? element('p', {className: landmark.doubtful ? 'bad' : 'soft', textContent:
        `The program proposed this point: ${doubtText(landmark)}. Move it by a click on the bone, or confirm it.`}) : null,
    checks.length ? element('ul', {className: 'checks'}, ...checks) : null,
    element('div', {className: 'row'},
        landmark && landmark.proposed ? button('It is right', () => confirm(code), {className: 'primary', title: 'Enter'}) : null,
        landmark ? button('Remove', () => act('remove', {site: code})) : null,
        isAbsent(code) ? null : button('Mark absent', () => act('absent', {site: code, reason: 'the bone is missing'})),
        button('Next open site', () => choose(nextOpen(code)), {title: 'N'})),
    landmark ? field('rename to', select(names, code, async (name) => {
      if (await act('rename', {site: code, name})) { choose(name); }
    })) : element('p', {className: 'hint', textContent: 'Click on the bone at this site, or turn the bone below the middle of the view and press P.'}),
    landmark ? direction : null,
    landmark && landmark.turned ? button('Turn back', () => act('turn', {site: code, direction: null}),
                                         {title: 'to the direction of the bone'}) : null,
    landmark ? remarks(landmark) : null,
    allSites
  ].filter((part) => part);
}

const confirmed = (state) => state.landmarks.filter(({site, proposed}) => !proposed && siteOf(site).standard).length;

function suggestion(state) {
  const placed = confirmed(state);
  return placed >= 3 ? `Suggest the other ${standardSites().length - placed}` : 'Suggest all by shape';
}

// One sentence that names the next step.
function guide(state, proposed, doubtful) {
  const next = nextStep();
  const text = proposed ? (doubtful ? `${doubtful} of the ${proposed} proposed points are doubtful: review them, the most doubtful first, or leave them out.`
                                    : 'Look at the proposed points. If they are right, confirm all at once.')
      : confirmed(state) < 3 && next ? `Click on the bone at ${nameOf(next)} (${next}). After ${FIRST_CLICKS.map(nameOf).join(', ')} the program suggests the rest.`
      : confirmed(state) < standardSites().length ? 'Let the program suggest the other sites, or place them yourself.' : '';
  return element('p', {className: 'hint', textContent: text});
}

export function landmarkPanel(bench) {
  const {scene} = bench;
  const head = element('div'), about = element('div', {className: 'about'}), list = element('div', {className: 'sites'});
  const format = select(FORMATS, '.yaml', () => {});
  format.setAttribute('aria-label', 'kind of file');
  const files = element('details', {}, element('summary', {textContent: 'Load and save landmarks'}),
      chooser(bench.opener, 'Landmarks', '.yaml,.yml,.json,.fcsv,.pp,.csv,.txt,.asc'),
      element('div', {className: 'row'}, format, button('Save as', () => download('landmarks', {format: format.value}))),
      button('Remove all', () => act('clear_landmarks')));
  const root = element('div', {}, head, about, list, files);

  const handle = dowelHandle(scene, () => {
    const words = about.querySelector('.direction');
    if (words) { words.textContent = handle.words(); }
  });
  const marks = () => {
    const state = store.state;
    scene.putMarks([
      ...state.landmarks.map((landmark) => ({
        site: landmark.site, point: landmark.point, hollow: landmark.proposed, chosen: landmark.site === store.site,
        colour: landmark.site === store.site ? '#0b5c8f' : doubts(landmark).length ? '#b3261e' : landmark.proposed ? '#b57d00' : '#1b7f3b'})),
      ...state.predicted.filter((predicted) => predicted.site === store.site)
          .map(({site, point}) => ({site: null, point, hollow: true, colour: '#0b5c8f', text: `${site} may be here`}))]);
  };

  const goOn = async (action) => { if (await act(action)) { bench.show('person'); } };

  const draw = () => {
    const state = store.state, placed = state.landmarks.filter(({site}) => siteOf(site).standard);
    const proposed = toReview().length, doubtful = toReview().filter((landmark) => landmark.doubtful).length;
    head.replaceChildren(
        element('p', {textContent: `${placed.length} of ${standardSites().length} sites are placed${proposed ? `, ${proposed} of them proposed` : ''}.`}),
        element('div', {className: 'row'},
            confirmed(state) === standardSites().length ? null : button(suggestion(state), () => act('propose'), {className: proposed ? '' : 'primary',
                   title: 'searches the other sites on the bone, from the points that you have placed'}),
            proposed ? button(`Review ${proposed}`, () => choose(toReview()[0].site),
                              {className: 'primary', title: 'the most doubtful first'}) : null,
            proposed && !doubtful ? button('All are right', () => goOn('confirm_all'), {title: 'confirms them, and goes on to the person'}) : null,
            doubtful ? button(`Leave out the ${doubtful} doubtful, keep the others`, () => goOn('leave_out_doubtful'),
                              {title: 'marks the doubtful ones as absent, confirms the others, and goes on to the person'}) : null),
        guide(state, proposed, doubtful),
        lines(state.errors, 'bad') || '', lines(state.notes, 'soft') || '');
    about.replaceChildren(...detail(store.site, handle));
    handle.show(landmarkOf(store.site));
    const further = store.sites.filter((site) => !site.standard);
    list.replaceChildren(...standardSites().map(row),
        element('details', {open: further.some((site) => landmarkOf(site.site))},
                element('summary', {textContent: 'Sites of other tables'}), ...further.map(row)));
    marks();
  };

  // Turns the view to the site, or to where the program expects it.
  const lookAt = (code) => {
    const known = landmarkOf(code) || store.state.predicted.find(({site}) => site === code);
    if (known) { scene.turnTo(known.point); return; }
    if (scene.shared.camera) { scene.shared.camera.look(code.endsWith('_l') ? 55 : code.endsWith('_r') ? -55 : 0, 5); }
  };

  const pick = async (hitOf, ray, among) => {
    const skull = hitOf(['skull']), ball = among(scene.marks.children);
    if (ball && ball.object.userData.site && (!skull || ball.distance <= skull.distance + 4)) {
      choose(ball.object.userData.site, {stay: true});
      return;
    }
    if (!skull || !store.site) { return; }
    await place(store.site, placeOf(ray, skull.point));
  };

  // The arguments of the action that places a site by a ray.
  const placeOf = (ray, point) => ({origin: ray.origin.toArray(), direction: ray.direction.toArray(), near: point.toArray()});
  const place = async (site, where, {stay = false} = {}) => {
    const isNew = !landmarkOf(site), wasProposed = !isNew && landmarkOf(site).proposed;
    const done = await act('place', {site, ...where});
    if (done && isNew && !stay) {
      const begun = FIRST_CLICKS.includes(site) && confirmed(store.state) === FIRST_CLICKS.length;  // the program can suggest the rest
      choose(nextStep() || (begun ? null : nextOpen(site)));
      if (begun) {
        head.scrollIntoView({block: 'nearest'});
        await act('propose');
      }
    }
    if (done && wasProposed && !stay && toReview().length) { choose(toReview()[0].site); }
  };

  // Handles a press on a ball for Scene.onDrag: a drag moves the landmark over the bone, a click chooses it.
  const grip = (event) => {
    const turning = handle.grip(event);
    if (turning) { return turning; }
    const {stage} = scene.main, skull = stage.hit(event, ['skull']);
    const ball = stage.ray.intersectObjects(scene.marks.children, true).find(({object}) => object.userData.site);
    if (!ball || (skull && ball.distance > skull.distance + 4)) { return null; }
    const {site} = ball.object.userData;
    let where = null;
    return {
      move: (next, still) => {
        const hit = still ? null : stage.hit(next, ['skull']);
        if (!hit) { return; }
        where = placeOf(stage.ray.ray, hit.point);
        ball.object.position.copy(hit.point);
        scene.draw();
      },
      end: async () => {
        choose(site, {stay: true});
        if (where) { await place(site, where, {stay: true}); }
      },
      cancel: marks
    };
  };

  // Places the chosen site under a point of the view, by default its middle: without a pointer, the head is turned below it.
  const placeAt = async (point, {stay = false} = {}) => {
    const {stage, canvas} = scene.main, box = canvas.getBoundingClientRect();
    const at = point ? point.clone().project(scene.shared.camera.camera) : {x: 0, y: 0};
    const hit = stage.hit({clientX: box.left + (at.x + 1) / 2 * box.width, clientY: box.top + (1 - at.y) / 2 * box.height}, ['skull']);
    if (hit && store.site) { await place(store.site, placeOf(stage.ray.ray, hit.point), {stay}); }
  };
  const nudge = async (key, mm) => {
    const landmark = landmarkOf(store.site), [right, up] = [0, 1].map((column) =>
        new THREE.Vector3().setFromMatrixColumn(scene.shared.camera.camera.matrixWorld, column));
    const by = {w: up, s: up.clone().negate(), d: right, a: right.clone().negate()}[key];
    await placeAt(new THREE.Vector3(...landmark.point).addScaledVector(by, mm), {stay: true});
  };

  onChoice((code, stay) => {
    if (!root.isConnected) { return; }
    draw();
    if (code && !stay) { lookAt(code); }
    if (code) { about.scrollIntoView({block: 'nearest'}); }  // the list may have been scrolled far down
  });
  document.addEventListener('keydown', (event) => {
    if (!root.isConnected || ['INPUT', 'SELECT'].includes(event.target.tagName)) { return; }
    const key = event.key.toLowerCase(), plain = !event.ctrlKey && !event.altKey && !event.metaKey;
    if (plain && key === 'p' && store.site) { placeAt(null); }
    if (plain && 'wasd'.includes(key) && store.site && landmarkOf(store.site)) { nudge(key, event.shiftKey ? 0.2 : 1); }
    if (plain && 'ijkl'.includes(key) && store.site && landmarkOf(store.site)) { handle.turn(key, event.shiftKey ? 1 : 3); }
    if (event.key.toLowerCase() === 'n' && !event.ctrlKey) { choose(nextOpen(store.site || '')); }
    if (event.key === 'Delete' && store.site && landmarkOf(store.site)) { act('remove', {site: store.site}); }
    if (event.key === 'Enter' && event.target.tagName !== 'BUTTON' && store.site && landmarkOf(store.site)) { confirm(store.site); }
  });
  return {
    element: root,
    // Not at each report of a job, because drawing takes the processor that the job needs.
    state: (state, former) => { if (!former || former.revision !== state.revision) { draw(); } },
    show: () => {
      scene.onPick = pick;
      scene.onDrag = grip;
      scene.shared.layers.get('face').shown = false;
      scene.shared.layers.get('dowels').shown = false;
      scene.update();
      if (store.state && !store.site) { store.site = nextStep() || nextOpen(''); }
    },
    hide: () => {
      scene.onPick = null;
      scene.onDrag = null;
      scene.shared.layers.get('face').shown = true;
      scene.shared.layers.get('dowels').shown = true;
      scene.putMarks([]);
      handle.hide();
      scene.update();
    }
  };
}
