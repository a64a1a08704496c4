#version 330
// The person as the sun sees them.
in vec3 position;
in vec3 cut;
uniform mat4 light;
out vec3 inside;

void main() {
    gl_Position = light * vec4(position, 1.0);
    inside = cut;
}
