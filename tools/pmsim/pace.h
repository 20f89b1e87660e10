// Keeps simulated time beside the clock on the wall. Knows no clock itself, so that tests have one of their
// own.
#ifndef PMSIM_PACE_H
#define PMSIM_PACE_H

namespace pmsim
{

class Pace
{
  public:
    // So late, the simulation gives up catching up and goes on from there.
    static constexpr double most_behind_s = 0.2;

    struct Step {
        double wait_s; // until simulated time is due; 0 when it is late
        double lost_s; // given up now; 0 nearly always
    };

    // Simulated time has come to t_s; both clocks began at 0.
    Step at(double t_s, double wall_s)
    {
        const double late_s = wall_s - lost_s_ - t_s;
        latest_s_ = late_s > latest_s_ ? late_s : latest_s_;
        if (late_s <= most_behind_s) {
            return {late_s < 0.0 ? -late_s : 0.0, 0.0};
        }
        lost_s_ += late_s;
        return {0.0, late_s};
    }

    double latest_s() const
    {
        return latest_s_;
    }
    double lost_s() const // all of it: simulated time is that far behind the wall
    {
        return lost_s_;
    }

  private:
    double latest_s_ = 0.0, lost_s_ = 0.0;
};

} // namespace pmsim

#endif
