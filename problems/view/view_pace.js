// SPDX-License-Identifier: GPL-3.0-or-later
// When the 3-D view is drawn, and how finely: once for all that changes before the next frame. Where a full picture takes
// long, as without a graphics card, coarser ones are drawn while something moves, and the full one once it rests.
'use strict';
class SemblancePace {
  static QUICK_MS = 50;    // a full picture that takes no longer is drawn each time
  static LEAST_SHARE = 0.5;  // of the full resolution, across and down
  static REST_MS = 250;    // without a change, then it rests

  // stages(): those to draw. beside(): draws what goes with them.
  constructor(stages, beside) {
    this.stages = stages;
    this.beside = beside;
    this.isBusy = () => false;  // whether the next change is on its way
    this.full_ms = 0;           // what the last full picture took that was timed
    this.timed_at = -Infinity;
    this.due = false;
    this.isFull = false;        // nothing moves, and the picture is a full one
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

  // Of the full resolution, while something moves.
  share() {
    const {QUICK_MS, LEAST_SHARE} = SemblancePace;
    return this.full_ms > QUICK_MS ? Math.max(LEAST_SHARE, Math.sqrt(QUICK_MS / this.full_ms)) : 1;
  }

  draw(share) {
    clearTimeout(this.rest);
    const start = performance.now();
    for (const stage of this.stages()) { stage.draw(share); }
    this.beside();
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

  // Waiting for the picture holds the page up: where pictures are quick, it is done once a second at most.
  time(start) {
    if (this.full_ms <= SemblancePace.QUICK_MS && start - this.timed_at < 1000) { return; }
    for (const stage of this.stages()) { stage.finish(); }
    this.full_ms = performance.now() - start;
    this.timed_at = start;
  }
}
