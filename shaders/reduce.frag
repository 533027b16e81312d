#version 330 core
// One level of the reduction pyramid: the sum of every block of 4 x 4 texels, clipped at the tile's edge.

uniform sampler2D level;
uniform ivec2 tile;    // texels of a tile in `level`
uniform ivec2 blocks;  // blocks of a tile

out vec4 sums;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy), corner = at / blocks, first = at % blocks * 4;
    ivec2 last = min(first + 4, tile);
    sums = vec4(0.0);
    for (int y = first.y; y < last.y; ++y)
        for (int x = first.x; x < last.x; ++x)
            sums += texelFetch(level, corner * tile + ivec2(x, y), 0);
}
