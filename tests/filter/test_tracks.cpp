#include <doctest/doctest.h>

#include "filter/sources/cameras/tracks.h"

using namespace ear;

namespace {
FeatureObservation feature(std::uint64_t id, double u) { return {id, {u, 0.0}, {u - 0.1, 0.0}, true}; }
}  // namespace

TEST_CASE("tracks: observations of one feature come together, in any order of ids") {
  TrackTable tracks;
  tracks.add(0, {feature(7, 0.1), feature(3, 0.2)});
  tracks.add(1, {feature(3, 0.3), feature(9, 0.4), feature(7, 0.5)});
  REQUIRE(tracks.size() == 3);
  CHECK(tracks[0].id == 3);
  CHECK(tracks[1].id == 7);
  CHECK(tracks[2].id == 9);
  REQUIRE(tracks[1].observations.size() == 2);
  CHECK(tracks[1].observations[0].left.x() == 0.1);
  CHECK(tracks[1].observations[1].left.x() == 0.5);
  CHECK(tracks[1].observations[1].frame == 1);
}

TEST_CASE("tracks: a feature that comes back under its old number is found again") {
  TrackTable tracks;
  tracks.add(0, {feature(5, 0.1), feature(8, 0.2)});
  tracks.keep_if([](const Track& track) { return track.id == 8; });
  tracks.add(1, {feature(5, 0.3), feature(8, 0.4)});
  tracks.add(2, {feature(5, 0.5), feature(8, 0.6)});
  REQUIRE(tracks.size() == 2);
  CHECK(tracks[0].id == 5);
  CHECK(tracks[0].observations.size() == 2);
  CHECK(tracks[1].observations.size() == 3);
}

TEST_CASE("tracks: a frame that leaves takes its observations along") {
  TrackTable tracks;
  tracks.add(0, {feature(1, 0.1), feature(2, 0.1)});
  tracks.add(1, {feature(2, 0.2)});
  tracks.forget_frame(0);
  REQUIRE(tracks.size() == 1);
  CHECK(tracks[0].id == 2);
  CHECK(tracks[0].observations.size() == 1);
}
