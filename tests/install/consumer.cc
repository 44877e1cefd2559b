#include <cstdio>

#include <datasets/pattern_files.h>
#include <recon/patterns.h>

int main() {
  const crumple::StripeOrientation rows{.angle_rad = 1.5707963267948966, .bits = 8};
  const auto bits = crumple::sufficient_bits(rows, {640, 480});
  std::printf("480 rows need %d bits\n", bits.value_or(0));
  return bits == 9 ? 0 : 1;
}
