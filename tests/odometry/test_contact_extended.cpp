// Contact on all sequences, as they are and with one beam that fails. docs/filter.md, "Contact", has the figures.
#include <doctest/doctest.h>

#include "tests/support/contact_run.h"
#include "tools/simulator/sequence.h"

using namespace ear;
using namespace ear::test;

namespace {

void report(const std::string& what, const ContactRun& run) {
  MESSAGE(what << ": " << run.hours << " h, wrong " << run.wrong << ", missed " << run.missed << ", take-offs "
               << run.takeoff_delay.size() << ", worst " << worst(run.takeoff_delay) << " s after 1 cm, at "
               << worst(run.takeoff_height) << " m, touchdowns " << run.touchdown_delay.size() << ", worst "
               << worst(run.touchdown_delay) << " s");
}

}  // namespace

TEST_CASE("contact: all sequences, three seeds") {
  ContactRun all;
  for (const std::string& name : simulator::sequence_names()) {
    CAPTURE(name);
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      CAPTURE(seed);
      const ContactRun run = run_contact(simulate_sensors(name, seed));
      CHECK(run.wrong == 0);
      CHECK(run.missed == 0);
      all.add(run);
    }
  }
  report("as they are", all);
  CHECK(worst(all.takeoff_height) < 0.03);
  CHECK(worst(all.touchdown_delay) < 0.02);
}

TEST_CASE("contact: one beam fails") {
  // Three times for 5 s.
  for (const std::string fault : {"laser_no_return", "laser_stuck", "laser_biased"}) {
    for (const std::string beam : {"front_left", "front_right", "rear"}) {
      CAPTURE(fault);
      CAPTURE(beam);
      ContactRun all;
      for (const std::string name : {"flat1", "wave1", "slope", "lawn", "fly1", "fly2", "sway1"}) {
        CAPTURE(name);
        std::vector<simulator::Fault> faults;
        for (const char* interval : {"@5+5", "@17+5", "@27+5"}) {
          faults.push_back(simulator::parse_fault(fault + '.' + beam + interval));
        }
        const ContactRun run = run_contact(simulate_sensors(name, 4, faults));
        CHECK(run.wrong == 0);
        CHECK(run.missed == 0);
        all.add(run);
      }
      report(fault + '.' + beam, all);
    }
  }
}
