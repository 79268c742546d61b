// SPDX-License-Identifier: GPL-3.0-or-later
// One canvas of the 3-D view with one scene.
'use strict';
class SemblanceStage {
  // shared: the state that the panel sets for all stages, and drawSoon(), which draws them all (SemblancePace); see
  // report_view.js.
  constructor(canvas, tip, shared) {
    this.canvas = canvas;
    this.tip = tip;
    this.shared = shared;
    // The buffer is kept so that a picture can be saved at any time.
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: true, preserveDrawingBuffer: true});
    this.paper();
    // Follows the page between dark and light.
    window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => { this.paper(); this.shared.drawSoon(); });
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
    this.draft = new SemblanceDraft(this.renderer);
    this.ray = new THREE.Raycaster();
    this.material = {
      dowel: new THREE.MeshPhongMaterial({color: 0xb3261e, shininess: 25}),
      end: new THREE.MeshPhongMaterial({color: 0x1d2126, shininess: 25}),
      residual: new THREE.MeshPhongMaterial({color: 0x7b1fa2, shininess: 25}),
    };
    this.extra = new THREE.Group();  // objects of other scripts
    this.afterDraw = [];             // called after each picture
    canvas.addEventListener('pointermove', (event) => this.point(event));
    canvas.addEventListener('pointerleave', () => { this.tip.hidden = true; });
  }

  // Uses the background colour of the canvas's style, or white.
  paper() {
    const colour = getComputedStyle(this.canvas).backgroundColor;
    const none = !colour || colour === 'transparent' || colour === 'rgba(0, 0, 0, 0)';
    this.renderer.setClearColor(new THREE.Color(none ? '#ffffff' : colour));
  }

  // Lights move with the camera, so that visible surfaces are lit.
  lights() {
    const group = new THREE.Group();
    const add = (colour, strength, x, y, z) => {
      const light = new THREE.DirectionalLight(colour, strength);
      light.position.set(x, y, z);
      group.add(light, light.target);
    };
    add(0xffffff, 0.55, -0.7, 0.9, 1);
    add(0xfff4e6, 0.22, 1, 0.1, 0.6);
    group.add(new THREE.AmbientLight(0xffffff, 0.42));
    return group;
  }

  show(description, blobs) {
    this.description = description;
    this.scene = new THREE.Scene();
    this.rig = this.lights();
    this.scene.add(this.rig, this.extra);
    this.layers = new Map();
    for (const layer of description.layers) { this.put(layer, blobs); }
    this.update();
  }

  // Adds a layer, or replaces the layer of the same id.
  put(layer, blobs) {
    const former = this.layers.get(layer.id);
    const object = layer.mesh ? this.surface(layer, blobs) : layer.lines ? this.lines(layer, blobs)
                                                                         : new THREE.Group();
    // Translucent layers are drawn from the inside out.
    object.renderOrder = former ? former.object.renderOrder : this.layers.size;
    this.drop(layer.id);
    this.layers.set(layer.id, {layer, object});
    this.scene.add(object);
  }

  drop(id) {
    const former = this.layers.get(id);
    if (!former) { return; }
    this.scene.remove(former.object);
    if (former.object.geometry) { former.object.geometry.dispose(); }
    this.layers.delete(id);
  }

  surface(layer, blobs) {
    const material = new THREE.MeshPhongMaterial({side: THREE.DoubleSide, shininess: 12, specular: 0x222222});
    const mesh = new THREE.Mesh(SemblanceGeometry.geometryOf(blobs[layer.mesh]), material);
    mesh.userData.values = layer.values && SemblanceGeometry.valuesOf(blobs[layer.values]);
    for (const part of layer.parts || []) {  // e.g. eyes: one colour, never translucent
      const wet = new THREE.MeshPhongMaterial({color: part.colour, shininess: 120, specular: 0x999999});
      const eye = new THREE.Mesh(SemblanceGeometry.geometryOf(blobs[part.mesh]), wet);
      eye.raycast = () => {};
      mesh.add(eye);
    }
    return mesh;
  }

  lines(layer, blobs) {
    return new THREE.LineSegments(SemblanceGeometry.geometryOf(blobs[layer.lines]),
                                  new THREE.LineBasicMaterial({color: layer.colour}));
  }

  // Draws depth markers: a rod from base to tip, and one from the tip towards the face, `exaggeration` times as long.
  dowels(layer, object, exaggeration) {
    const {vector, cylinder, ball} = SemblanceGeometry;
    object.clear ? object.clear() : object.remove(...object.children);
    for (const dowel of layer.dowels) {
      const tip = vector(dowel.tip), parts = [
        cylinder(vector(dowel.base), tip, 0.9, this.material.dowel), ball(tip, 1.5, this.material.end)];
      if (dowel.on_face) {
        const end = tip.clone().lerp(vector(dowel.on_face), exaggeration);
        parts.push(cylinder(tip, end, 0.7, this.material.residual), ball(end, 0.9, this.material.residual));
      }
      const residual = dowel.on_face ? `, face ${dowel.residual_mm.toFixed(2)} mm off` : dowel.fitted === 'unknown' ? '' : ', not fitted';
      for (const part of parts) {
        part.userData.text = `${dowel.name || `depth marker ${dowel.site}`}: depth ${dowel.depth_mm.toFixed(2)} mm${residual}`;
        object.add(part);
      }
    }
  }

  // Applies the state of the panel.
  update() {
    for (const {layer, object} of this.layers.values()) {
      const state = this.shared.layers.get(layer.id);
      object.visible = state.shown;
      if (layer.dowels && object.userData.exaggeration !== this.shared.exaggeration) {
        object.userData.exaggeration = this.shared.exaggeration;
        this.dowels(layer, object, this.shared.exaggeration);
      }
      if (object.material) {
        object.material.opacity = state.opacity;
        object.material.transparent = state.opacity < 1;
        object.material.needsUpdate = true;
      }
      if (layer.mesh) { this.paint(layer, object); }
    }
    this.shared.drawSoon();  // one picture for all changes
  }

  // The values and map that colour a surface, or null. A difference from another stage takes precedence.
  mapOf(layer, mesh) {
    const {values, difference} = mesh.userData;
    if (difference && this.shared.difference) { return {values: difference, map: this.description.maps.error}; }
    return values && (layer.always_mapped || this.shared.mapped) ? {values, map: this.description.maps[layer.map]} : null;
  }

  paint(layer, mesh) {
    const mapped = this.mapOf(layer, mesh);
    if (mapped) {
      mesh.geometry.setAttribute('color', SemblanceGeometry.coloursOf(mapped.values, mapped.map, this.shared.range_mm));
    }
    // Colours that stand for numbers are matte.
    mesh.material.specular.set(mapped ? 0x000000 : 0x222222);
    mesh.material.vertexColors = mapped ? THREE.VertexColors : THREE.NoColors;
    mesh.material.color.set(mapped ? '#ffffff' : layer.colour);
    mesh.material.side = mesh.material.transparent ? THREE.FrontSide : THREE.DoubleSide;
  }

  // Draws at a share of the full resolution; see SemblancePace. Saved pictures have the full one.
  draw(share = 1) {
    const width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    if (!this.scene || !this.shared.camera || width === 0 || height === 0) { return; }
    const camera = this.shared.camera.camera, size = this.renderer.getSize(new THREE.Vector2());
    if (size.x !== width || size.y !== height) { this.renderer.setSize(width, height, false); }
    camera.aspect = width / height;
    // A narrow canvas shows at least as much as a square one.
    const half = Math.tan(this.shared.camera.angle * Math.PI / 360) / Math.min(1, camera.aspect);
    camera.fov = 360 / Math.PI * Math.atan(half);
    camera.updateProjectionMatrix();
    this.rig.quaternion.copy(camera.quaternion);
    if (share < 1) { this.draft.draw(this.scene, camera, share); } else { this.renderer.render(this.scene, camera); }
    for (const act of this.afterDraw) { act(); }
  }

  // Waits for the picture by reading a pixel.
  finish() {
    const pen = this.renderer.getContext();
    pen.readPixels(0, 0, 1, 1, pen.RGBA, pen.UNSIGNED_BYTE, new Uint8Array(4));
  }

  // The first hit under the pointer among the visible layers `ids` (default: all), or null.
  hit(event, ids) {
    if (!this.scene || !this.shared.camera) { return null; }
    const box = this.canvas.getBoundingClientRect();
    const at = new THREE.Vector2(2 * (event.clientX - box.left) / box.width - 1,
                                 1 - 2 * (event.clientY - box.top) / box.height);
    this.ray.setFromCamera(at, this.shared.camera.camera);
    const shown = [...this.layers.values()]
        .filter(({layer, object}) => object.visible && !object.isLineSegments && (!ids || ids.includes(layer.id)))
        .map(({object}) => object);
    const planes = this.renderer.clippingPlanes;
    return this.ray.intersectObjects(shown, true)
        .find(({point}) => planes.every((plane) => plane.distanceToPoint(point) >= 0)) || null;
  }

  // Shows a tip about the surface under the pointer.
  point(event) {
    if (event.buttons || !this.scene) { this.tip.hidden = true; return; }
    const box = this.canvas.getBoundingClientRect(), hit = this.hit(event);
    this.tip.hidden = !hit;
    if (hit) {
      this.tip.textContent = this.textOf(hit);
      this.tip.style.left = `${event.clientX - box.left + 14}px`;
      this.tip.style.top = `${event.clientY - box.top + 10}px`;
    }
  }

  textOf(hit) {
    if (hit.object.userData.text) { return hit.object.userData.text; }
    const found = [...this.layers.values()].find(({object}) => object === hit.object);
    const difference = this.shared.difference && hit.object.userData.difference;
    const values = difference || hit.object.userData.values, map = found.layer.map;
    if (!values) { return found.layer.label; }
    const value = values[hit.face.a], scale = difference ? 0 : this.description.maps[map].scale;
    if (scale && !isNaN(value)) { return `${found.layer.label}: ${+(scale * value).toPrecision(3)} ${this.description.unit ?? 'mm'}`.trimEnd(); }
    const sign = value > 0 && (difference || map === 'error') ? '+' : '';
    return `${found.layer.label}: ${isNaN(value) ? 'no value here' : `${sign}${value.toFixed(1)} mm`}`;
  }
}
