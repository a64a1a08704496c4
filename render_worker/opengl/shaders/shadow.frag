#version 330
in vec3 inside;
uniform bool edges;

void main() {
    if (edges && min(inside.x, min(inside.y, inside.z)) < 0.0)
        discard;
}
