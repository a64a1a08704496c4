#version 330
in vec2 place;
in vec3 seen_by_sun;
uniform sampler2D image;
uniform sampler2DShadow shadow;
uniform float lit_shade;
uniform float shadow_shade;
out vec4 colour;

void main() {
    float sun = 0.0;
    for (int k = 0; k < 4; k++) {
        vec2 offset = (vec2(k & 1, k >> 1) - 0.5) * 0.004;
        sun += texture(shadow, vec3(seen_by_sun.xy + offset, seen_by_sun.z - 0.002));
    }
    colour = vec4(texture(image, place).rgb * mix(shadow_shade, lit_shade, sun * 0.25), 1.0);
}
