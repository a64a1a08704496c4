#version 330
// As ground.vert places it.
in vec3 position;
in vec2 uv;
uniform mat4 view_projection;
out vec2 place;
// Both programs of the ground must place it alike: what one has drawn, the other leaves.
invariant gl_Position;

void main() {
    gl_Position = view_projection * vec4(position, 1.0);
    place = uv;
}
