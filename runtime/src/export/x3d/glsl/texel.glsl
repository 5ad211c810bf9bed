// The texel at texture coordinates, which count from the last row of the distances.
ivec2 texelAt(vec2 texCoord) {
  ivec2 size = textureSize(distances, 0);
  ivec2 charted = ivec2(size.x, int(distanceRows));
  ivec2 fromTop = ivec2(floor(vec2(texCoord.x, 1.0 - texCoord.y) * vec2(charted)));
  fromTop = clamp(fromTop, ivec2(0), charted - 1);
  return ivec2(fromTop.x, rowFromTop(fromTop.y, size.y));
}
