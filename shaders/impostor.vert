#version 330 core
// One instance is one primitive of one hypothesis: a rectangle in its tile, drawn as a strip of four vertices.

uniform float atlas_side;  // pixels

layout(location = 0) in vec4 rectangle;  // left, top, right, bottom edges, pixels of the atlas
layout(location = 1) in vec4 column_x;   // the map from (x, y, 1, w) to the unit frame, column by column
layout(location = 2) in vec4 column_y;
layout(location = 3) in vec4 column_1;
layout(location = 4) in vec4 column_w;
layout(location = 5) in vec4 frame;      // inverse depth of the middle, 1 for a ball or 0 for a cylinder, anchor

flat out vec4 map_x, map_y, map_1, map_w, reference;

void main() {
    vec2 corner = mix(rectangle.xy, rectangle.zw, vec2(gl_VertexID & 1, gl_VertexID >> 1));
    gl_Position = vec4(corner / atlas_side * 2.0 - 1.0, 0.0, 1.0);
    map_x = column_x;
    map_y = column_y;
    map_1 = column_1;
    map_w = column_w;
    reference = frame;
}
