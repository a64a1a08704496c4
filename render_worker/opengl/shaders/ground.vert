#version 330
// The ground around the person, on which their shadow falls.
in vec3 position;
in vec2 uv;
uniform mat4 view_projection;
uniform mat4 light;
out vec2 place;
out vec3 seen_by_sun;
// Both programs of the ground must place it alike: what one has drawn, the other leaves.
invariant gl_Position;

void main() {
    gl_Position = view_projection * vec4(position, 1.0);
    place = uv;
    seen_by_sun = (light * vec4(position, 1.0)).xyz * 0.5 + 0.5;
}
