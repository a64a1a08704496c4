#version 330
// The ground where no shadow can fall.
in vec2 place;
uniform sampler2D image;
uniform float lit_shade;
out vec4 colour;

void main() {
    colour = vec4(texture(image, place).rgb * lit_shade, 1.0);
}
