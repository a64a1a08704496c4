#version 330
in vec2 place;
in vec3 gain;
in vec3 veil;
uniform sampler2D image;
out vec4 colour;

void main() {
    colour = vec4(texture(image, place).rgb * gain + veil, 1.0);
}
