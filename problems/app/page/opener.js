// SPDX-License-Identifier: GPL-3.0-or-later
// Opens a file in the workbench: chosen, dropped, or by its path on this machine. The program identifies its kind. The
// person confirms first if the file would replace something.
import {post, upload} from './api.js';
import {documentation, kindOf} from './controls.js';
import {button, element, field, select} from './dom.js';
import {act, onState, showMessage, store} from './store.js';
import {volumeLook} from './volume_look.js';

const MAX_BYTES = 512 * 2 ** 20;  // the program's limit of a file from the browser
const SKIPPED = /(^|\/)(\.[^/]*|Thumbs\.db|desktop\.ini)$/i;
const KINDS = {mesh: 'a mesh', volume: 'a CT or MR', config: 'a configuration', landmarks: 'landmarks'};
const WAYS = {
  mesh: {head: 'Skull of another head', skull: 'Skull of this head; its landmarks stay', skin: 'Skin of this head'},
  volume: {head: 'Skull and skin of another head', skin: 'Skin of this head'},
  config: {head: 'Head and options', options: 'Options alone, for this head'},
  landmarks: {landmarks: 'Use these landmarks'},
};

// Makes a name valid on every machine: no control characters, no dot in front, not too long.
const safePart = (part) => {
  const clean = part.replace(/[\u0000-\u001f\u007f\\]/g, '_').replace(/^\.+/, '_');
  const end = /\.[A-Za-z0-9]{1,5}(\.gz)?$/.exec(clean)?.[0] || '';
  let stem = clean.slice(0, clean.length - end.length);
  while (new TextEncoder().encode(stem).length > 150) { stem = stem.slice(0, -10); }
  return `${stem}${end}` || '_';
};
const safeName = (name) => name.split('/').filter((part) => part).map(safePart).join('/');

// The files of a drop, including those in folders: [{file, name}]. Must be called before the event ends.
export const filesOfDrop = (transfer) => {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry && item.webkitGetAsEntry()).filter((entry) => entry);
  const read = async (entry) => {
    if (entry.isFile) {
      return new Promise((take, fail) => entry.file((file) => take([{file, name: entry.fullPath}]), fail));
    }
    const reader = entry.createReader(), found = [];
    for (;;) {  // a reader returns at most a hundred entries at a time
      const some = await new Promise((take, fail) => reader.readEntries(take, fail));
      if (!some.length) { return found; }
      for (const inner of some) { found.push(...await read(inner)); }
    }
  };
  return entries.length ? Promise.all(entries.map(read)).then((lists) => lists.flat())
                        : Promise.resolve([...transfer.files].map((file) => ({file, name: file.name})));
};

const words = (text) => text.replaceAll(`${store.state ? store.state.folder : ''}/incoming/`, '').replace(/(^|\s)[a-z0-9]{12}\//g, '$1');

export class Opener {
  constructor(root) {
    this.root = root;
    this.imported = null;  // the identified file: {kind, path, name, ways}
    this.batch = null;     // of the uploaded files
    this.waits = false;    // true while the program opens the file
    this.volume = {};      // options for reading a volume that the person has changed
    onState((state) => this.state(state));
  }

  async files(list) {
    const files = list.filter(({name}) => !SKIPPED.test(name));
    if (!files.length) { showMessage('The folder holds no file.'); return; }
    const large = files.find(({file}) => file.size > MAX_BYTES);
    if (large) {
      showMessage(`${large.name}: ${Math.round(large.file.size / 2 ** 20)} MB; at most 512 MB can be uploaded. Enter its path on this machine instead.`);
      return;
    }
    await this.identify(async () => {
      const batch = Array.from(crypto.getRandomValues(new Uint8Array(12)), (n) => (n % 36).toString(36)).join('');
      this.batch = batch;
      this.count = files.length;
      for (const [n, {file, name}] of files.entries()) {
        this.show(`Reading ${n + 1} of ${files.length} \u2026`);
        await upload(file, batch, safeName(name));
      }
      return {batch};
    });
  }

  async path(path) {
    if (path) { await this.identify(async () => ({path})); }
  }

  // Identifies a file. An earlier file that was not opened is dropped.
  async identify(bring) {
    await this.forget();
    this.volume = {};
    showMessage('');
    try {
      this.imported = await post('look', await bring());
      if (this.imported.name === this.batch) { this.imported.name = `${this.count} files`; }  // slices without a folder
    } catch (error) {
      await this.forget();
      showMessage(words(error.message));
      return;
    }
    const {triangles} = store.state.subject, [usual] = this.imported.ways;
    const replaces = usual === 'landmarks' ? store.state.landmarks.length : triangles;
    if (replaces || this.imported.kind === 'volume') { this.draw(); } else { this.open(usual); }
  }

  async open(as) {
    const axes = this.axes ? this.axes.value : '';
    const {path, kind} = this.imported;
    this.waits = true;
    this.show(`Opening ${this.imported.name} \u2026`);
    const done = await act('open', {path, as, axes, ...(kind === 'volume' ? {volume: this.volume} : {})});
    if (!done) { this.waits = false; this.draw(); }
  }

  state({job}) {
    if (!this.waits || job.name !== 'open' || job.state === 'running') { return; }
    this.waits = false;
    if (job.state === 'done') {
      const notes = job.words, name = this.imported.name;
      this.batch = null;
      this.imported = null;
      this.show(notes ? `${name}: ${notes}` : '');
      return;
    }
    this.draw();
    showMessage(job.state === 'stopped' ? 'Stopped; nothing has changed.' : words(job.words));
  }

  // Deletes the uploaded files that were not opened.
  async forget() {
    const {batch} = this;
    this.batch = null;
    this.imported = null;
    this.waits = false;
    this.show('');
    if (batch) { await act('forget', {batch}); }
  }

  // Hides the remarks on a file that is open already.
  dismiss() { if (!this.waits && !this.imported) { this.show(''); } }

  show(text) {
    this.root.hidden = !text;
    this.root.replaceChildren(text ? element('p', {textContent: text}) : '',
        text && !this.waits && !this.batch ? button('Close', () => this.show('')) : '');
  }

  draw() {
    const {kind, name, path, ways} = this.imported, {landmarks, edited_vertices: edits, subject} = store.state;
    const head = `this head${landmarks.length ? `, its ${landmarks.length} landmarks` : ''}${edits ? ', its edits' : ''}`;
    const replaced = kind === 'landmarks' ? `the present ${landmarks.length} landmarks` : head;
    this.axes = kind === 'landmarks' ? select([['', 'as the file states'], ['LPS', 'LPS'], ['RAS', 'RAS']], '', () => {}) : null;
    const usable = ways.filter((way) => way !== 'skin' && way !== 'skull' && way !== 'options' || subject.triangles);
    this.root.hidden = false;
    this.root.replaceChildren(
        element('h2', {textContent: name}),
        element('p', {className: 'soft', textContent: `${KINDS[kind]}${this.batch ? '' : `: ${path}`}`}),
        (kind === 'landmarks' ? landmarks.length : subject.triangles)
            ? element('p', {textContent: `${kind === 'landmarks' ? 'The file replaces' : 'Another head replaces'} ${replaced}. Undo restores it.`}) : '',
        this.axes ? field('axes', this.axes, 'used if the file states none') : '',
        kind === 'volume' ? this.look() : '',
        kind === 'volume' ? this.volumeControls() : '',
        element('div', {className: 'ways'}, ...usable.map((way) => button(WAYS[kind][way], () => this.open(way), {dataset: {way}})),
                button('Cancel', () => this.forget())));
    this.root.querySelector('.ways button').focus({preventScroll: true});
  }

  // The slices stay while the options below them are drawn again.
  look() {
    const {import: usual} = this.ctOptions(), of = (name) => usual.properties[name].default;
    if (this.looked !== this.imported) {
      this.looked = this.imported;
      this.lookElement = volumeLook(this.imported.path, this.volume, {bone_hu: of('bone_hu'), skin_hu: of('skin_hu')}, () => {
        const controls = this.root.querySelector('details.reading');
        if (controls) { controls.replaceWith(this.volumeControls()); }
      });
    }
    return this.lookElement;
  }

  ctOptions() {
    return kindOf(store.schema.properties.subject).objects.find((object) => object.properties.type.const === 'ct').properties;
  }

  // Options for reading a volume, with controls made from the program's schema.
  volumeControls() {
    const ct = this.ctOptions();
    const row = (name, schema, target) => {
      const {doc, unit: stated} = documentation(schema), kind = kindOf(schema), unit = name.endsWith('_hu') ? 'HU' : stated;
      const set = (value) => { if (value === '') { delete target()[name]; } else { target()[name] = value; } };
      const made = kind.kind === 'bool' ? element('input', {type: 'checkbox', checked: Boolean(target()[name]), onchange: () => set(made.checked)})
          : kind.kind === 'word' ? select(kind.words.map((word) => [word, word.replaceAll('_', ' ')]), target()[name] ?? schema.default, set)
          : element('input', {type: kind.kind === 'number' ? 'number' : 'text', step: 'any', value: target()[name] ?? schema.default ?? '',
                              onchange: () => set(kind.kind === 'number' && made.value !== '' ? Number(made.value) : made.value)});
      made.title = doc;
      return field(`${name.replaceAll('_', ' ').replace(/ (mm|hu|cm2)$/, '')}${unit ? ` (${unit})` : ''}`, made);
    };
    const inner = () => { this.volume.import = this.volume.import || {}; return this.volume.import; };
    return element('details', {className: 'reading'}, element('summary', {textContent: 'Reading options'}),
        ...['series', 'fill_slices'].map((name) => row(name, ct[name], () => this.volume)),
        ...Object.entries(ct.import.properties).map(([name, schema]) => row(name, schema, inner)));
  }
}

// Controls to choose files or a folder in the browser, or to enter a path on this machine.
export const chooser = (opener, label, accept) => {
  const pick = (input) => opener.files([...input.files].map((file) => ({file, name: file.webkitRelativePath || file.name})))
      .finally(() => { input.value = ''; });
  const file = element('input', {type: 'file', multiple: true, accept, onchange: () => pick(file)});
  const folder = element('input', {type: 'file', webkitdirectory: true, hidden: true, onchange: () => pick(folder)});
  const path = element('input', {type: 'text', placeholder: 'or a path on this machine', spellcheck: false});
  const open = button('Open', () => opener.path(path.value.trim()));
  path.addEventListener('keydown', (event) => { if (event.key === 'Enter') { open.click(); } });
  file.setAttribute('aria-label', label);
  path.setAttribute('aria-label', `${label}: path`);
  return element('div', {className: 'chooser'}, element('strong', {textContent: label}),
                 element('div', {className: 'row'}, file, accept ? '' : button('A folder \u2026', () => folder.click()), folder),
                 element('div', {className: 'row'}, path, open));
};

// Opens files that are dropped anywhere on the page.
export const takeDrops = (opener) => {
  const isFile = (event) => event.dataTransfer && [...event.dataTransfer.types].includes('Files');
  let depth = 0;  // number of nested elements that the pointer has entered
  const mark = () => document.body.classList.toggle('dropping', depth > 0);
  document.addEventListener('dragenter', (event) => { if (isFile(event)) { ++depth; mark(); } });
  document.addEventListener('dragleave', (event) => { if (isFile(event)) { depth = Math.max(0, depth - 1); mark(); } });
  document.addEventListener('dragover', (event) => { if (isFile(event)) { event.preventDefault(); } });
  document.addEventListener('drop', (event) => {
    if (!isFile(event)) { return; }
    event.preventDefault();
    depth = 0;
    mark();
    filesOfDrop(event.dataTransfer).then((files) => opener.files(files)).catch((error) => showMessage(error.message));
  });
};
