"""Does structure.py count members and functions as a reader would?"""

import unittest

import structure

TEXT = """
class Small final : public Base {
 public:
  explicit Small(int a) : a_(a) {}
  [[nodiscard]] int sum() const { return a_ + b_; }
  void set(int a, int b = 3);  // a_; in a comment
  using Row = std::array<int, 3>;
  static constexpr int kMost = 3;

 private:
  struct Inner {
    int x = 0;
    int y = 0;
  };
  int a_ = 0, b_ = 0;
  std::map<int, Inner> inner_;
  std::vector<int> rows_{};
};
"""


class Structure(unittest.TestCase):
    def test_counts(self):
        text = structure.without_comments(TEXT)
        match = structure.CLASS.search(text)
        self.assertEqual(match[1], "Small")
        self.assertEqual(structure.measure(structure.body_from(text, match.end() - 1)), (4, 3))

    def test_constants(self):
        text = """
constexpr double kTick = 0.03;  // [s] chosen: between two looks
// Measured by tools/bench.
inline constexpr double kShare = 0.1;
constexpr double kBare = 1.0;  // [m] of something
  static constexpr int kA = 0, kB = 1;
constexpr std::array<double, 2> kBoth = {1.0, 2.0};
// constexpr double kGone = 2.0;
inline constexpr int theta = 0;
"""
        self.assertEqual(structure.constants_of(text), (["kTick", "kShare", "kBare", "kA", "kBoth"], ["kBare"]))

    def test_loose_bounds(self):
        self.assertTrue(structure.LOOSE_BOUND.search("CHECK(x == doctest::Approx(f(0.3)).epsilon(0.1));"))
        self.assertFalse(structure.LOOSE_BOUND.search("CHECK(x == doctest::Approx(f(0.3)).epsilon(1e-9));"))
        self.assertFalse(structure.LOOSE_BOUND.search("CHECK(x == doctest::Approx(300.0).epsilon(0.01).scale(300.0));"))
        self.assertFalse(structure.LOOSE_BOUND.search("CHECK(x == about(0.3, 0.1));"))


if __name__ == "__main__":
    unittest.main()
