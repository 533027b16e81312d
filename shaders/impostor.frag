#version 330 core
// Intersects the pixel's ray with a unit ball or an open unit cylinder. Writes the inverse depth of the face visible
// from outside, or 0. Blending keeps the maximum, so the nearest surface wins without a depth buffer.

uniform float inverse_near;  // 1/m, of the near plane

flat in vec4 map_x, map_y, map_1, map_w, reference;
out float inverse_depth;

void main() {
    // The ray in the unit frame is a + w map_w, with w counted from the primitive's middle.
    vec2 pixel = gl_FragCoord.xy - reference.zw;
    vec4 a = map_x * pixel.x + map_y * pixel.y + map_1;
    float ball = reference.y;

    // On the surface ux^2 + uy^2 (+ uz^2 for a ball) = uw^2: A + 2 B w + C w^2 = 0.
    vec4 metric = vec4(1.0, 1.0, ball, -1.0);
    float A = dot(metric * a, a);
    float B = dot(metric * a, map_w);
    float C = dot(metric * map_w, map_w);
    float discriminant = B * B - A * C;

    // At the face visible from outside the quadratic increases with w. The expression that adds avoids cancellation.
    float root = sqrt(discriminant);
    bool adds = B <= 0.0;
    float w = (adds ? root - B : -A) / (adds ? C : root + B);

    float along = a.z + w * map_w.z, end = a.w + w * map_w.w;
    bool within = ball > 0.0 || (0.0 <= along && along <= end);
    w += reference.x;
    inverse_depth = discriminant >= 0.0 && within && w <= inverse_near ? max(w, 0.0) : 0.0;
}
