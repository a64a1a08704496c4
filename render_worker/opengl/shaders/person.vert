#version 330
// A corner of the person, in the world frame.
in vec3 position;
in vec3 normal;
in vec3 uv;
in vec3 cut;
uniform mat4 view_projection;
out vec3 world;
out vec3 facing;
out vec3 place;
out vec3 inside;

void main() {
    gl_Position = view_projection * vec4(position, 1.0);
    world = position;
    facing = normal;
    place = uv;
    inside = cut;
}
