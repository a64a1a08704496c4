#version 330
// Sky, walls and the ground, lit evenly: `shade` is the light on them, `haze` how much air is before them.
in vec3 position;
in vec2 uv;
in float shade;
in float haze;
uniform mat4 view_projection;
uniform vec3 air;
out vec2 place;
out vec3 gain;
out vec3 veil;

void main() {
    gl_Position = view_projection * vec4(position, 1.0);
    place = uv;
    gain = vec3(shade * (1.0 - haze));
    veil = air * haze;
}
