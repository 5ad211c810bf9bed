uniform float lowerLimit; // Millimetres; the tolerance, within which the scale is neutral, and
uniform float upperLimit;
uniform float stepBeyond; // the width of a step of colour beyond it; 0 where the scale is continuous.

// The colour of a deviation in millimetres: that of the far end of its step, where there are steps.
vec3 scaled(float deviation) {
  if (stepBeyond <= 0.0) return colour(deviation);
  float excess = deviation > upperLimit ? deviation - upperLimit : lowerLimit - deviation;
  if (excess <= 0.0) return colour(0.0);
  float steps = clamp(ceil(excess / stepBeyond - 0.00001), 1.0, //!bands);
  return colour((deviation > upperLimit ? steps : -steps) / //!bands * colourRange);
}
