// SPDX-License-Identifier: GPL-3.0-or-later
// Landmarks: a list of the sites, details of the chosen site, and clicks on the bone.
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

const doubts = (landmark) =>
    Object.keys(DOUBTFUL).filter((check) => landmark[check] !== null && landmark[check] > DOUBTFUL[check]);

function row(site) {
  const landmark = landmarkOf(site.site), absent = isAbsent(site.site);
  const mark = landmark ? (landmark.proposed ? '\u25cc' : '\u25cf') : absent ? '\u2013' : '\u25cb';
  const words = landmark ? (landmark.proposed ? 'proposed: check it' : doubts(landmark).length ? 'check again' : '')
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

function detail(code) {
  if (!code) {
    return [element('p', {className: 'soft', textContent: 'Choose a site, then click on the bone. Click on a ball to choose its site.'})];
  }
  const site = siteOf(code), landmark = landmarkOf(code);
  const checks = landmark ? Object.keys(MEANINGS).filter((check) => landmark[check] !== null && landmark[check] !== undefined)
      .map((check) => element('li', {className: landmark[check] > DOUBTFUL[check] ? 'bad' : ''},
          element('strong', {textContent: millimetres(landmark[check])}), ` ${MEANINGS[check]}`)) : [];
  const names = store.sites.map((other) => [other.site, `${other.site}: ${nameOf(other.site)}`]);
  return [
    element('h2', {textContent: nameOf(code)}),
    element('div', {className: 'site-place'}, element('p', {textContent: `${site.definition}.`}), pictureOf(code)),
    checks.length ? element('ul', {className: 'checks'}, ...checks) : null,
    element('div', {className: 'row'},
        landmark && landmark.proposed ? button('Confirm', () => act('confirm', {site: code}), {className: 'primary'}) : null,
        landmark ? button('Remove', () => act('remove', {site: code})) : null,
        isAbsent(code) ? null : button('Mark absent', () => act('absent', {site: code, reason: 'the bone is missing'})),
        button('Next open site', () => choose(nextOpen(code)), {title: 'N'})),
    landmark ? field('rename to', select(names, code, async (name) => {
      if (await act('rename', {site: code, name})) { choose(name); }
    })) : element('p', {className: 'hint', textContent: 'Click on the bone at this site.'}),
    landmark ? remarks(landmark) : null,
    allSites
  ].filter((part) => part);
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

  const marks = () => {
    const state = store.state;
    scene.putMarks([
      ...state.landmarks.map((landmark) => ({
        site: landmark.site, point: landmark.point, hollow: landmark.proposed, chosen: landmark.site === store.site,
        colour: landmark.site === store.site ? '#0b5c8f' : doubts(landmark).length ? '#b3261e' : landmark.proposed ? '#b57d00' : '#1b7f3b'})),
      ...state.predicted.filter((predicted) => predicted.site === store.site)
          .map(({site, point}) => ({site: null, point, hollow: true, colour: '#0b5c8f', text: `${site} may be here`}))]);
  };

  const draw = () => {
    const state = store.state, placed = state.landmarks.filter(({site}) => siteOf(site).standard);
    const proposed = state.landmarks.filter((landmark) => landmark.proposed).length;
    head.replaceChildren(
        element('p', {textContent: `${placed.length} of ${standardSites().length} sites are placed${proposed ? `, ${proposed} of them proposed` : ''}.`}),
        element('div', {className: 'row'},
            state.predicted.length ? button(`Suggest the other ${state.predicted.length}`, () => act('take_predicted'),
                                           {title: 'predicted from the placed sites and an average skull'}) : null,
            button('Propose by shape', () => act('propose'), {title: 'searches all sites on the bone; takes a minute'}),
            proposed ? button('Confirm all', () => act('confirm_all')) : null),
        lines(state.errors, 'bad') || '', lines(state.notes, 'soft') || '');
    about.replaceChildren(...detail(store.site));
    const further = store.sites.filter((site) => !site.standard);
    list.replaceChildren(...standardSites().map(row),
        element('details', {open: further.some((site) => landmarkOf(site.site))},
                element('summary', {textContent: 'Sites of other tables'}), ...further.map(row)));
    marks();
  };

  const pick = async (hitOf, ray, among) => {
    const skull = hitOf(['skull']), ball = among(scene.marks.children);
    if (ball && ball.object.userData.site && (!skull || ball.distance <= skull.distance + 4)) {
      choose(ball.object.userData.site);
      return;
    }
    if (!skull || !store.site) { return; }
    const site = store.site, isNew = !landmarkOf(site);
    const done = await act('place', {site, origin: ray.origin.toArray(), direction: ray.direction.toArray(), near: skull.point.toArray()});
    if (done && isNew) { choose(nextOpen(site)); }
  };

  onChoice((code) => {
    if (!root.isConnected) { return; }
    draw();
    if (code) { about.scrollIntoView({block: 'nearest'}); }  // the list may have been scrolled far down
  });
  document.addEventListener('keydown', (event) => {
    if (!root.isConnected || ['INPUT', 'SELECT'].includes(event.target.tagName)) { return; }
    if (event.key.toLowerCase() === 'n' && !event.ctrlKey) { choose(nextOpen(store.site || '')); }
    if (event.key === 'Delete' && store.site && landmarkOf(store.site)) { act('remove', {site: store.site}); }
    if (event.key === 'Enter' && event.target.tagName !== 'BUTTON' && store.site && landmarkOf(store.site)) { act('confirm', {site: store.site}); }
  });
  return {
    element: root,
    state: draw,
    show: () => {
      scene.onPick = pick;
      scene.shared.layers.get('face').shown = false;
      scene.shared.layers.get('dowels').shown = false;
      scene.update();
      if (store.state && !store.site) { store.site = nextOpen(''); }
    },
    hide: () => {
      scene.onPick = null;
      scene.shared.layers.get('face').shown = true;
      scene.shared.layers.get('dowels').shown = true;
      scene.putMarks([]);
      scene.update();
    }
  };
}
