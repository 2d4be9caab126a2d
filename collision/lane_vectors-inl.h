// Vectors of lanes, for kernels that are written for any lane type. Included once per instruction
// set, inside its namespace, so no include guard.

template <class L>
struct Vec {
  L x, y, z;
};
// Not friends: gcc forgets the instruction set of friends of class templates.
template <class L>
Vec<L> operator+(const Vec<L>& a, const Vec<L>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class L>
Vec<L> operator-(const Vec<L>& a, const Vec<L>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class L>
Vec<L> operator*(const Vec<L>& a, const L& s) {
  return {a.x * s, a.y * s, a.z * s};
}
template <class L>
L dot(const Vec<L>& a, const Vec<L>& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
template <class L>
Vec<L> cross(const Vec<L>& a, const Vec<L>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class L, class Mask>
Vec<L> select(Mask mask, const Vec<L>& yes, const Vec<L>& no) {
  return {select(mask, yes.x, no.x), select(mask, yes.y, no.y), select(mask, yes.z, no.z)};
}
