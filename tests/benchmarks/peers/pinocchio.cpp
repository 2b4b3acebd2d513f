// Times Pinocchio: rnea() of the whole robot, and the full decomposition by its best recipe: for each link j the chain
// of the joints that move it, with link j's inertia alone, through rnea, crba, computeCoriolisMatrix and
// computeGeneralizedGravity; and tau_ij alone, by its best recipe for that: computeJointTorqueRegressor(), each link's block
// times its ten parameters. Standard input: joints and gravity, then a line a joint:
// parent kind rotation(9) translation(3) mass com(3) inertia(9). Only headers are used, so that the robot's types
// have this compiler's alignment. Prints "name nanoseconds" lines, then "tau" and "split": each tau_ij by either recipe at
// q = qd = qdd = 0.1 (i + 1).
#include <chrono>
#include <cstdio>
#include <iostream>
#include <vector>

#if __has_include(<pinocchio/multibody/model.hpp>)
#include <pinocchio/multibody/data.hpp>
#include <pinocchio/multibody/model.hpp>
#else
#include <pinocchio/multibody.hpp>
#endif

#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/regressor.hpp>
#include <pinocchio/algorithm/rnea.hpp>

using namespace pinocchio;

/// The joints of the robots here. Pinocchio's default list has 25 kinds, which cost minutes and gigabytes to compile.
template <typename Scalar_, int Options_> struct Joints {
    typedef Scalar_ Scalar;
    static constexpr int Options = Options_;
    typedef JointModelRevoluteTpl<Scalar, Options, 2> JointModelRZ;
    typedef JointModelPrismaticTpl<Scalar, Options, 2> JointModelPZ;
    typedef JointDataRevoluteTpl<Scalar, Options, 2> JointDataRZ;
    typedef JointDataPrismaticTpl<Scalar, Options, 2> JointDataPZ;
    typedef JointModelMimicTpl<Scalar, Options, ::Joints> JointModelMimic;
    typedef JointDataMimicTpl<Scalar, Options, ::Joints> JointDataMimic;
    typedef JointModelCompositeTpl<Scalar, Options, ::Joints> JointModelComposite;
    typedef JointDataCompositeTpl<Scalar, Options, ::Joints> JointDataComposite;
    typedef boost::variant<JointModelRZ, JointModelPZ, boost::recursive_wrapper<JointModelComposite>,
        boost::recursive_wrapper<JointModelMimic>> JointModelVariant;
    typedef boost::variant<JointDataRZ, JointDataPZ, boost::recursive_wrapper<JointDataComposite>,
        boost::recursive_wrapper<JointDataMimic>> JointDataVariant;
};
using RobotModel = ModelTpl<double, 0, Joints>;
using RobotData = DataTpl<double, 0, Joints>;
using Vectors = std::vector<Eigen::VectorXd>;
constexpr int SAMPLES = 32;

struct Part {
    int parent;
    bool slides;
    SE3 placement;
    Inertia inertia;
};

struct Chain {
    RobotModel model;
    RobotData data;
    Vectors q, v, a;
};

static std::vector<Part> read(Eigen::Vector3d &gravity)
{
    int count;
    std::cin >> count >> gravity[0] >> gravity[1] >> gravity[2];
    std::vector<Part> parts;
    for (int j = 0; j < count; ++j) {
        int parent;
        std::string kind;
        Eigen::Matrix3d rotation, moment;
        Eigen::Vector3d translation, com;
        double mass;
        std::cin >> parent >> kind;
        for (int e = 0; e < 9; ++e)
            std::cin >> rotation(e / 3, e % 3);
        for (int e = 0; e < 3; ++e)
            std::cin >> translation[e];
        std::cin >> mass;
        for (int e = 0; e < 3; ++e)
            std::cin >> com[e];
        for (int e = 0; e < 9; ++e)
            std::cin >> moment(e / 3, e % 3);
        parts.push_back({parent, kind == "prismatic", SE3(rotation, translation), Inertia(mass, com, moment)});
    }
    return parts;
}

/// Joints of `links`, parents first; the bodies listed in `heavy` have their inertia, the others none.
static Chain build(const std::vector<Part> &parts, const std::vector<int> &links, int only,
    const Eigen::Vector3d &gravity, const Vectors motion[3])
{
    RobotModel model;
    std::vector<JointIndex> index(parts.size(), 0);
    for (int j : links) {
        const JointIndex parent = parts[j].parent < 0 ? 0 : index[parts[j].parent];
        const std::string name = std::to_string(j);
        index[j] = parts[j].slides ? model.addJoint(parent, JointModelPZ(), parts[j].placement, name)
                                   : model.addJoint(parent, JointModelRZ(), parts[j].placement, name);
        if (only < 0 || only == j)
            model.appendBodyToJoint(index[j], parts[j].inertia, SE3::Identity());
    }
    model.gravity.linear() = gravity;
    Chain chain{model, RobotData(model), {}, {}, {}};
    Vectors *to[3] = {&chain.q, &chain.v, &chain.a};
    for (int m = 0; m < 3; ++m)
        for (const Eigen::VectorXd &whole : motion[m]) {
            Eigen::VectorXd part(links.size());
            for (size_t k = 0; k < links.size(); ++k)
                part[k] = whole[links[k]];
            to[m]->push_back(part);
        }
    return chain;
}

template <class Call> static double best(Call call)
{
    using clock = std::chrono::steady_clock;
    double least = 1e300, spent = 0;
    for (int repeat = 0; repeat < 25 || spent < 3e8; ++repeat) {
        const auto start = clock::now();
        for (int s = 0; s < SAMPLES; ++s)
            call(s);
        const std::chrono::duration<double, std::nano> took = clock::now() - start;
        least = std::min(least, took.count() / SAMPLES);
        spent += took.count();
    }
    return least;
}

int main()
{
    Eigen::Vector3d gravity;
    const std::vector<Part> parts = read(gravity);
    const int n = static_cast<int>(parts.size());
    Vectors motion[3];
    for (Vectors &samples : motion) {
        for (int s = 0; s < SAMPLES; ++s)
            samples.push_back(Eigen::VectorXd::Random(n));
        samples[0] = Eigen::VectorXd::LinSpaced(n, 0.1, 0.1 * n);
    }
    std::vector<int> all;
    for (int j = 0; j < n; ++j)
        all.push_back(j);
    Chain whole = build(parts, all, -1, gravity, motion);
    std::vector<Chain> chains;
    for (int j = 0; j < n; ++j) {
        std::vector<int> path;
        for (int i = j; i >= 0; i = parts[i].parent)
            path.insert(path.begin(), i);
        chains.push_back(build(parts, path, j, gravity, motion));
    }
    std::printf("rnea %.5g\n", best([&](int s) { rnea(whole.model, whole.data, whole.q[s], whole.v[s], whole.a[s]); }));
    std::printf("decomposition %.5g\n", best([&](int s) {
        for (Chain &c : chains) {
            rnea(c.model, c.data, c.q[s], c.v[s], c.a[s]);
            crba(c.model, c.data, c.q[s], Convention::LOCAL);
            computeCoriolisMatrix(c.model, c.data, c.q[s], c.v[s]);
            computeGeneralizedGravity(c.model, c.data, c.q[s]);
        }
    }));
    std::vector<Eigen::Matrix<double, 10, 1>> bodies;
    for (int j = 0; j < n; ++j)
        bodies.push_back(whole.model.inertias[j + 1].toDynamicParameters());
    Eigen::MatrixXd split = Eigen::MatrixXd::Zero(n, n);
    const auto regress = [&](int s) {
        const auto &y = computeJointTorqueRegressor(whole.model, whole.data, whole.q[s], whole.v[s], whole.a[s]);
        for (int j = 0; j < n; ++j)
            split.col(j).head(j + 1).noalias() = y.block(0, 10 * j, j + 1, 10) * bodies[j];
    };
    std::printf("regressor %.5g\n", best(regress));
    regress(0);
    std::printf("tau");
    for (Chain &c : chains) {
        const Eigen::VectorXd &tau = rnea(c.model, c.data, c.q[0], c.v[0], c.a[0]);
        for (Eigen::Index i = 0; i < tau.size(); ++i)
            std::printf(" %.17g", tau[i]);
    }
    std::printf("\nsplit");
    for (int j = 0; j < n; ++j) {
        std::vector<int> path;
        for (int i = j; i >= 0; i = parts[i].parent)
            path.insert(path.begin(), i);
        for (int i : path)
            std::printf(" %.17g", split(i, j));
    }
    std::printf("\n");
}
