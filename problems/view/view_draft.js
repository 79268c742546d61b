// SPDX-License-Identifier: GPL-3.0-or-later
// A quick picture of a scene: fewer pixels, jagged edges, stretched over the canvas, whose own size stays.
'use strict';
class SemblanceDraft {
  constructor(renderer) {
    this.renderer = renderer;
    this.target = new THREE.WebGLRenderTarget(1, 1);
    // A material of three.js would be cut by the clipping planes.
    const material = new THREE.ShaderMaterial({
      uniforms: {picture: {value: this.target.texture}}, depthTest: false, depthWrite: false,
      vertexShader: 'varying vec2 at; void main() { at = uv; gl_Position = vec4(2.0 * uv - 1.0, 0.0, 1.0); }',
      fragmentShader: 'uniform sampler2D picture; varying vec2 at; void main() { gl_FragColor = texture2D(picture, at); }'});
    this.sheet = new THREE.Mesh(new THREE.PlaneBufferGeometry(1, 1), material);
    this.sheet.frustumCulled = false;
    this.camera = new THREE.Camera();
  }

  // share: of the canvas's pixels, across and down.
  draw(scene, camera, share) {
    const {renderer, target} = this, size = renderer.getDrawingBufferSize(new THREE.Vector2());
    target.setSize(Math.ceil(share * size.x), Math.ceil(share * size.y));  // does nothing where it has it
    renderer.setRenderTarget(target);
    renderer.render(scene, camera);
    renderer.setRenderTarget(null);
    renderer.render(this.sheet, this.camera);
  }
}
