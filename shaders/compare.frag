#version 330 core
// Sums of Oikonomidis et al. 2011, Eq. (2), over blocks of 4 x 4 pixels, clipped at the tile's edge.

uniform sampler2D inverse_depth;  // 1/m, 0 = nothing drawn; tiles of the atlas
uniform sampler2D observation;    // depth o_d in metres, 0 = no reading; silhouette o_s, 0 or 1;
                                  // inverse depths, 1/m, that a surface before an occluder exceeds, and one before
                                  // the surroundings; 0 = none
uniform ivec2 tile;               // pixels
uniform ivec2 blocks;             // blocks of a tile
uniform float match_depth, clamp_depth;  // d_m, d_M, metres
uniform float before_cost;               // further cost of a pixel before an occluder, in pixels outside the silhouette

out vec4 sums;  // clamped difference in metres, o_s and r_m, o_s or r_m

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy), corner = at / blocks, first = at % blocks * 4;
    ivec2 last = min(first + 4, tile);
    sums = vec4(0.0);
    for (int y = first.y; y < last.y; ++y) {
        for (int x = first.x; x < last.x; ++x) {
            vec4 observed = texelFetch(observation, ivec2(x, y), 0);
            float w = texelFetch(inverse_depth, corner * tile + ivec2(x, y), 0).r;
            bool drawn = w > observed.a;
            float difference = abs(observed.r - (drawn ? 1.0 / w : 0.0));
            bool matched = drawn && (difference < match_depth || observed.r == 0.0);
            float before = observed.b > 0.0 && w > observed.b ? before_cost : 0.0;
            sums.x += min(difference, clamp_depth) + before * clamp_depth;
            sums.y += matched ? observed.g : 0.0;
            sums.z += (matched ? 1.0 : observed.g) + before * (1.0 - observed.g);
        }
    }
}
