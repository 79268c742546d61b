// SPDX-License-Identifier: GPL-3.0-or-later
// Keeps the page in step with the program: with changes by another tab, and with a program that was started again.
import {get} from './api.js';
import {isRunning} from './job.js';
import {setState, store} from './store.js';

const EVERY_MS = 2000;

// lost: an element that is shown while the program does not answer.
export function keepInSync(lost) {
  let asked = false;
  const look = async () => {
    if (asked || document.hidden || isRunning()) { return; }
    asked = true;
    const known = store.state;
    try {
      const state = await get('state'), wasLost = !lost.hidden;
      lost.hidden = true;
      if (store.state === known && (wasLost || JSON.stringify(state) !== JSON.stringify(known))) {
        setState(state, {whole: wasLost});
      }
    } catch {
      lost.textContent = 'The program does not answer. Start it again with this folder: the page goes on by itself, and nothing is lost.';
      lost.hidden = false;
    }
    asked = false;
  };
  setInterval(look, EVERY_MS);
  document.addEventListener('visibilitychange', look);
}
