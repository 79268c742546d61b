// SPDX-License-Identifier: GPL-3.0-or-later
// The direction of the chosen landmark's depth marker: an arrow whose tip can be dragged or turned by keys.
import {get} from './api.js';
import {act} from './store.js';

const LENGTH_MM = 20, NEAR_PX = 14, MOST_DEG = 75;

// changed(): called when the direction of the chosen site has become known.
export function dowelHandle(scene, changed) {
  let dowel = null;  // {site, base, own, direction} as vectors
  let asked = 0;

  const tip = (direction) => dowel.base.clone().addScaledVector(direction, LENGTH_MM);
  const draw = (direction) => scene.putArrow(dowel.base, tip(direction));
  const turnedBy = () => dowel.own.angleTo(dowel.direction) * 180 / Math.PI;
  const vector = (numbers) => new THREE.Vector3(...numbers);

  const hide = () => {
    dowel = null;
    ++asked;
    scene.putArrow(null);
  };

  // Shows the dowel of a landmark, or nothing.
  const show = async (landmark) => {
    hide();
    if (!landmark) { return; }
    const question = asked;
    try {
      const {base, own, direction} = await get('direction', {site: landmark.site});
      if (question !== asked) { return; }
      dowel = {site: landmark.site, base: vector(base), own: vector(own), direction: vector(direction)};
      draw(dowel.direction);
      changed();
    } catch { /* the landmark lies off the bone, which its checks show */ }
  };

  const words = () => !dowel ? '' : turnedBy() < 0.5 ? 'Its marker points as the bone does. Drag the tip of the arrow to turn it.'
      : `Its marker is turned by ${turnedBy().toFixed(0)}\u00b0 from the direction of the bone.`;

  // The program refuses directions along the bone and into the head; here they end at the limit.
  const limited = (direction) => {
    const most = MOST_DEG * Math.PI / 180, angle = dowel.own.angleTo(direction);
    if (angle <= most) { return direction; }
    const axis = dowel.own.clone().cross(direction).normalize();
    return dowel.own.clone().applyAxisAngle(axis, most - 1e-3);
  };

  const place = (point) => {
    const box = scene.main.canvas.getBoundingClientRect(), at = point.clone().project(scene.shared.camera.camera);
    return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];
  };

  // The direction to the point of the sphere around the base that is under the pointer, or nearest to it.
  const under = (event) => {
    const {stage, canvas} = scene.main, box = canvas.getBoundingClientRect();
    stage.ray.setFromCamera(new THREE.Vector2(2 * (event.clientX - box.left) / box.width - 1,
                                              1 - 2 * (event.clientY - box.top) / box.height), scene.shared.camera.camera);
    const hit = stage.ray.ray.intersectSphere(new THREE.Sphere(dowel.base, LENGTH_MM), new THREE.Vector3())
        || stage.ray.ray.closestPointToPoint(dowel.base, new THREE.Vector3());
    return limited(hit.sub(dowel.base).normalize());
  };

  const send = (direction) => act('turn', {site: dowel.site, direction: direction.toArray()});

  return {
    show, hide, words,
    // Handles a press on the tip for Scene.onDrag; null for a press elsewhere.
    grip: (event) => {
      if (!dowel) { return null; }
      const [x, y] = place(tip(dowel.direction));
      if (Math.hypot(event.clientX - x, event.clientY - y) > NEAR_PX) { return null; }
      let direction = null;
      return {
        move: (next, still) => {
          if (still || !dowel) { return; }
          direction = under(next);
          draw(direction);
        },
        end: () => { if (direction && dowel) { send(direction); } },
        cancel: () => { if (dowel) { draw(dowel.direction); } }
      };
    },
    // I and K turn it up and down in the view, J and L to the left and right.
    turn: (key, degrees) => {
      if (!dowel) { return; }
      const [right, up] = [0, 1].map((column) => new THREE.Vector3().setFromMatrixColumn(scene.shared.camera.camera.matrixWorld, column));
      const [axis, sign] = {i: [right, -1], k: [right, 1], j: [up, -1], l: [up, 1]}[key];
      send(limited(dowel.direction.clone().applyAxisAngle(axis, sign * degrees * Math.PI / 180)));
    }
  };
}
