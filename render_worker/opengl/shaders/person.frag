#version 330
// Skin and cloth under a sun with soft shadows and a sky above a ground. Light is linear, squares stand for gamma.
in vec3 world;
in vec3 facing;
in vec3 place;
in vec3 inside;
uniform sampler2DArray textures;
uniform sampler2DShadow shadow;
uniform mat4 light;
uniform vec3 towards_sun;
uniform vec3 sun;
uniform vec3 sky;
uniform vec3 bounce;
uniform bool edges;
out vec4 colour;

float lit(float towards) {
    // A step along the normal keeps a surface out of its own shadow.
    vec3 at = (light * vec4(world + facing * 0.008, 1.0)).xyz * 0.5 + 0.5;
    // What is turned away from the sun is dark whatever its shadow says, and software runs a loop once at least.
    int taps = towards > 0.0 ? 4 : 1;
    float sum = 0.0;
    int k = 0;
    do {
        vec2 offset = (vec2(k & 1, k >> 1) - 0.5) * 0.004;
        sum += texture(shadow, vec3(at.xy + offset, at.z));
        k++;
    } while (k < taps);
    return sum * 0.25;
}

void main() {
    if (edges && min(inside.x, min(inside.y, inside.z)) < 0.0)
        discard;
    vec3 albedo = texture(textures, place).rgb;
    // Of cloth, the inside is seen too.
    vec3 n = normalize(gl_FrontFacing ? facing : -facing);
    float towards = dot(n, towards_sun) * 0.9 + 0.1;
    float direct = max(towards, 0.0) * lit(towards);
    vec3 ambient = mix(bounce, sky, n.z * 0.5 + 0.5);
    vec3 reflected = albedo * albedo * (ambient + sun * direct);
    colour = vec4(sqrt(reflected / (1.0 + 0.18 * reflected)), 1.0);
}
