// SPDX-License-Identifier: GPL-3.0-or-later
// Schedules the drawing of the 3-D view: once per frame for all changes. If a full picture takes long, e.g. without a
// graphics card, coarser pictures are drawn while something moves, and a full one when it rests.
'use strict';
class SemblancePace {
  static QUICK_MS = 50;    // a full picture that takes no longer is always drawn in full
  static LEAST_SHARE = 0.5;  // of the full resolution, across and down
  static REST_MS = 250;    // without a change until the view counts as resting

  // stages(): the canvases to draw. drawExtras(): draws the compass and similar.
  constructor(stages, drawExtras) {
    this.stages = stages;
    this.drawExtras = drawExtras;
    this.isBusy = () => false;  // true while another change is coming
    this.full_ms = 0;           // duration of the last timed full picture
    this.timed_at = -Infinity;
    this.due = false;
    this.isFull = false;        // the picture is a full one and nothing moves
  }

  soon() {
    this.isFull = false;
    if (this.due) { return; }
    this.due = true;
    requestAnimationFrame(() => {
      this.due = false;
      this.draw(this.share());
    });
  }

  // The share of the full resolution to draw while something moves.
  share() {
    const {QUICK_MS, LEAST_SHARE} = SemblancePace;
    return this.full_ms > QUICK_MS ? Math.max(LEAST_SHARE, Math.sqrt(QUICK_MS / this.full_ms)) : 1;
  }

  draw(share) {
    clearTimeout(this.rest);
    const start = performance.now();
    for (const stage of this.stages()) { stage.draw(share); }
    this.drawExtras();
    if (share < 1) {
      this.rest = setTimeout(() => this.settle(), SemblancePace.REST_MS);
    } else {
      this.time(start);
      this.isFull = true;
    }
  }

  settle() {
    if (this.isBusy()) {
      this.rest = setTimeout(() => this.settle(), SemblancePace.REST_MS);
    } else if (!this.due) {
      this.draw(1);
    }
  }

  // Waiting for the picture blocks the page, so quick pictures are timed at most once a second.
  time(start) {
    if (this.full_ms <= SemblancePace.QUICK_MS && start - this.timed_at < 1000) { return; }
    for (const stage of this.stages()) { stage.finish(); }
    this.full_ms = performance.now() - start;
    this.timed_at = start;
  }
}
