// SPDX-License-Identifier: GPL-3.0-or-later
// A quick, coarse picture of a scene: fewer pixels, stretched over the canvas. The canvas keeps its size.
'use strict';
class SemblanceDraft {
  constructor(renderer) {
    this.renderer = renderer;
    this.target = new THREE.WebGLRenderTarget(1, 1);
    // Clipping planes would cut a standard material of three.js, so the sheet has a shader of its own.
    const material = new THREE.ShaderMaterial({
      uniforms: {picture: {value: this.target.texture}}, depthTest: false, depthWrite: false,
      vertexShader: 'varying vec2 at; void main() { at = uv; gl_Position = vec4(2.0 * uv - 1.0, 0.0, 1.0); }',
      fragmentShader: 'uniform sampler2D picture; varying vec2 at; void main() { gl_FragColor = texture2D(picture, at); }'});
    this.sheet = new THREE.Mesh(new THREE.PlaneBufferGeometry(1, 1), material);
    this.sheet.frustumCulled = false;
    this.camera = new THREE.Camera();
  }

  // `share` is the resolution relative to the canvas, across and down.
  draw(scene, camera, share) {
    const {renderer, target} = this, size = renderer.getDrawingBufferSize(new THREE.Vector2());
    target.setSize(Math.ceil(share * size.x), Math.ceil(share * size.y));  // does nothing if the size is unchanged
    renderer.setRenderTarget(target);
    renderer.render(scene, camera);
    renderer.setRenderTarget(null);
    renderer.render(this.sheet, this.camera);
  }
}
