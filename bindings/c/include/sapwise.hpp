// Classes for C++17 over sapwise.h, whose contract holds here too: units, threads, lifetime of lists.
//
// A call that fails throws sapwise::Error. With SAPWISE_NO_EXCEPTIONS it returns a sapwise::Result or a sw_status
// instead, and constructors leave an object that converts to false.
#ifndef SAPWISE_HPP
#define SAPWISE_HPP
#include "sapwise.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>
#ifndef SAPWISE_NO_EXCEPTIONS
#include <exception>
#include <stdexcept>
#endif

namespace sapwise {
using Handle = std::uint64_t;
using Status = sw_status;
using Vector = std::array<float, 3>;

struct Box {
    Vector min, max;
    float *bounds() { return min.data(); }
    const float *bounds() const { return min.data(); }
};
struct Body : sw_body {
    Body(std::uint32_t of_kind = SW_MOVING) : sw_body SW_BODY_DEFAULT { kind = of_kind; }
};

template <class T> class Span {
    // Of T, or of T without const. Not of a class derived from T, whose objects lie further apart.
    template <class U> using Of = std::enable_if_t<std::is_convertible_v<U (*)[], T (*)[]>>;
    template <class C> using Element = std::remove_pointer_t<decltype(std::declval<C &>().data())>;
public:
    Span() = default;
    template <class U, class = Of<U>> Span(U *first, std::size_t size) : first_(first), size_(size) {}
    template <class C, class = Of<Element<C>>> Span(C &&c) : Span(c.data(), c.size()) {}
    T *data() const { return first_; }
    std::size_t size() const { return size_; }
    T *begin() const { return first_; }
    T *end() const { return first_ + size_; }
    T &operator[](std::size_t at) const { return first_[at]; }
private:
    T *first_ = nullptr;
    std::size_t size_ = 0;
};
template <class T> struct PairOf { T a, b; };
using Pair = PairOf<Handle>;
using IndexPair = PairOf<std::uint32_t>;

// Boxes in your own structs: Boxes(&first.min.x, &first.max.x, n, sizeof first).
struct Boxes {
    const float *min, *max;
    std::size_t size, stride;
    Boxes(const float *lows, const float *highs, std::size_t n, std::size_t bytes)
        : min(lows), max(highs), size(n), stride(bytes) {}
    template <class C, class = std::enable_if_t<std::is_convertible_v<const C &, Span<const Box>>>>
    Boxes(const C &c) : Boxes(Span<const Box>(c)) {}
    Boxes(Span<const Box> boxes) : Boxes(boxes.size() ? boxes[0].bounds() : nullptr, nullptr, boxes.size(), 0) {}
};
// The points origin + t * direction, 0 <= t <= max.
struct Ray {
    Vector origin, direction;
    float max = std::numeric_limits<float>::infinity();
};
struct Hit {
    Handle handle; // 0: none
    float t;
};

#ifdef SAPWISE_NO_EXCEPTIONS
template <class T> struct [[nodiscard]] Result {
    Status status;
    T value;
    explicit operator bool() const { return status == SW_OK; }
    T &operator*() { return value; }
};
struct [[nodiscard]] Done {
    Status status;
    operator Status() const { return status; }
};
template <class T> Result<T> result(Status status, const T &value) { return {status, value}; }
inline Done done(Status status) { return {status}; }
inline Done unequal() { return {SW_INVALID_ARGUMENT}; }
#else
struct Error : std::runtime_error {
    Status status;
    explicit Error(Status of, const char *what = sw_last_error()) : std::runtime_error(what), status(of) {}
};
template <class T> using Result = T;
using Done = void;
inline void done(Status status) { if (status != SW_OK) throw Error(status); }
[[noreturn]] inline Done unequal() {
    throw Error(SW_INVALID_ARGUMENT, "give one handle, and one body or one for all, for each box");
}
template <class T> T result(Status status, const T &value) { done(status); return value; }
#endif

namespace detail {
// Calls a function of the user's from C, and keeps its exception until C has returned. A function that returns nothing
// wants all.
template <class F> struct Callback {
    F &function;
    template <class R, class... A> R run(A... arguments) {
        if constexpr (!std::is_void_v<decltype(function(arguments...))>) return static_cast<R>(function(arguments...));
        else return function(arguments...), std::is_same_v<R, float> ? std::numeric_limits<R>::infinity() : R(1);
    }
#ifdef SAPWISE_NO_EXCEPTIONS
    template <class R, class... A> static R call(void *user, A... arguments) {
        return static_cast<Callback *>(user)->template run<R>(arguments...);
    }
#else
    std::exception_ptr thrown = nullptr;
    template <class R, class... A> static R call(void *user, A... arguments) {
        auto &self = *static_cast<Callback *>(user);
        try {
            return self.template run<R>(arguments...);
        } catch (...) {
            self.thrown = std::current_exception();
            return std::is_same_v<R, float> ? R(-1) : R(0);
        }
    }
#endif
};
template <class R, class... A, class F, class Query, class... Rest> Done query(F &f, Query run, Rest... rest) {
    Callback<F> to{f};
    Status status = run(rest..., &Callback<F>::template call<R, A...>, &to);
#ifndef SAPWISE_NO_EXCEPTIONS
    if (to.thrown) std::rethrow_exception(to.thrown);
#endif
    return done(status);
}

template <auto Free> struct Freer {
    template <class T> void operator()(T *of) const { Free(of); }
};
template <class T, auto Free> struct Owner : std::unique_ptr<T, Freer<Free>> {
    explicit Owner(T *made) : std::unique_ptr<T, Freer<Free>>(made) {
#ifndef SAPWISE_NO_EXCEPTIONS
        if (!made) throw Error(sw_last_status());
#endif
    }
};
template <class P, class L> Result<Span<const P>> pairs(const L *list, const std::size_t &count) {
    static_assert(sizeof(P) == 2 * sizeof(L), "two numbers without padding");
    return result(list ? SW_OK : sw_last_status(), Span<const P>(reinterpret_cast<const P *>(list), count));
}
template <class T> std::string text(std::size_t (*describe)(const T *, char *, std::size_t), const T *of) {
    std::string text(describe(of, nullptr, 0), '\0');
    describe(of, text.data(), text.size() + 1);
    return text;
}
} // namespace detail

class Space : public detail::Owner<sw_space, sw_space_free> {
public:
    Space() : Owner(sw_space_new()) {}
    explicit Space(const sw_options &options) : Owner(sw_space_new_with(&options)) {}
    static Space measured(const char *cache_folder = nullptr) { return Space(sw_space_new_measured(cache_folder)); }
    Space clone() const { return Space(sw_space_clone(get())); }
    Done assign(const Space &from) { return done(sw_space_assign(get(), from.get())); }
    Done set_limit(std::size_t pairs) { return done(sw_space_set_limit(get(), pairs)); }
    Done reserve(std::size_t more) { return done(sw_space_reserve(get(), more)); }
    Result<Handle> insert(const Box &box, const Body &body = {}) {
        Handle handle = 0;
        return result(sw_space_insert(get(), box.bounds(), &body, &handle), handle);
    }
    Done insert(const Boxes &b, Span<Handle> handles, const Body &body = {}) {
        if (b.size != handles.size()) return unequal();
        return done(sw_space_insert_many(get(), b.min, b.size, b.stride, b.max, &body, handles.data()));
    }
    // A body for each box.
    Done insert(const Boxes &b, Span<Handle> handles, Span<const Body> bodies) {
        if (b.size != handles.size() || b.size != bodies.size()) return unequal();
        return done(
            sw_space_insert_bodies(get(), b.min, b.size, b.stride, b.max, bodies.data(), handles.data()));
    }
    Done set(Handle handle, const Box &box) { return done(sw_space_set(get(), handle, box.bounds())); }
    Done set(Span<const Handle> handles, const Boxes &b) {
        if (b.size != handles.size()) return unequal();
        return done(sw_space_set_many(get(), handles.data(), b.min, b.size, b.stride, b.max));
    }
    Done set_body(Handle handle, const Body &body) { return done(sw_space_set_body(get(), handle, &body)); }
    Done remove(Handle handle) { return done(sw_space_remove(get(), handle)); }
    Done remove(Span<const Handle> all) { return done(sw_space_remove_many(get(), all.data(), all.size())); }
    Done update() { return done(sw_space_update(get())); }
    // Valid until the next update.
    Result<Span<const Pair>> pairs() const { return list(sw_space_pairs); }
    Result<Span<const Pair>> begun() const { return list(sw_space_begun); }
    Result<Span<const Pair>> ended() const { return list(sw_space_ended); }
    std::size_t size() const { return sw_space_len(get()); }
    // False also on failure, such as beside an update.
    bool contains(Handle handle) const { return sw_space_contains(get(), handle); }
    Result<std::pair<Box, Body>> find(Handle handle) const {
        std::pair<Box, Body> found;
        return result(sw_space_get(get(), handle, found.first.bounds(), &found.second), found);
    }
    Result<std::vector<Handle>> handles() const {
        std::vector<Handle> all(size());
        return result(sw_space_handles(get(), all.data(), all.size()), all);
    }
    Done save() const { return done(sw_space_save(get())); }
    std::string describe() const { return detail::text(sw_space_describe, get()); }

    // found(Handle) returns false for no more, or nothing. The last argument of a query: what `by` may meet.
    template <class F> Done query_box(const Box &box, F &&found, const Body *by = nullptr) const {
        return detail::query<int, Handle>(found, sw_space_query_box, get(), box.bounds(), by);
    }
    // found(std::size_t index, Handle)
    template <class F> Done query_boxes(const Boxes &b, F &&found, const Body *by = nullptr) const {
        return detail::query<int, std::size_t, Handle>(
            found, sw_space_query_boxes, get(), b.min, b.size, b.stride, b.max, by);
    }
    template <class F> Done query_point(Vector point, F &&found, const Body *by = nullptr) const {
        return detail::query<int, Handle>(found, sw_space_query_point, get(), point.data(), by);
    }
    // hit(Handle, float t) returns the new maximum of t, which never rises; or nothing, to find all.
    template <class F> Done cast_ray(const Ray &r, F &&hit, const Body *by = nullptr) const {
        const float *from = r.origin.data(), *direction = r.direction.data();
        return detail::query<float, Handle, float>(hit, sw_space_cast_ray, get(), from, direction, r.max, by);
    }
    Result<Hit> first_hit(const Ray &r, const Body *by = nullptr) const {
        Hit hit{0, r.max};
        const float *from = r.origin.data(), *direction = r.direction.data();
        return result(sw_space_first_hit(get(), from, direction, r.max, by, &hit.handle, &hit.t), hit);
    }
    template <class F> Done cast_box(const Box &box, Vector motion, F &&hit, const Body *by = nullptr) const {
        return detail::query<float, Handle, float>(hit, sw_space_cast_box, get(), box.bounds(), motion.data(), by);
    }
    // near(Handle, float distance), nearest first
    template <class F> Done nearest(Vector point, std::size_t k, F &&near, const Body *by = nullptr) const {
        return detail::query<int, Handle, float>(near, sw_space_nearest, get(), point.data(), k, by);
    }

private:
    explicit Space(sw_space *space) : Owner(space) {}
    Result<Span<const Pair>> list(const std::uint64_t *(*of)(const sw_space *, std::size_t *)) const {
        std::size_t n = 0;
        return detail::pairs<Pair>(of(get(), &n), n);
    }
};

// Pairs of boxes in arrays. The lists are valid until the next call.
class Search : public detail::Owner<sw_search, sw_search_free> {
public:
    Search() : Owner(sw_search_new(nullptr)) {}
    explicit Search(const sw_options &options) : Owner(sw_search_new(&options)) {}
    Done set_limit(std::size_t pairs) { return done(sw_search_set_limit(get(), pairs)); }
    Done set_sorted(bool sorted) { return done(sw_search_set_sorted(get(), sorted)); }
    Done set_bodies(Span<const Body> b) { return done(sw_search_set_bodies(get(), b.data(), b.size())); }
    Result<Span<const IndexPair>> find_pairs(const Boxes &b) {
        std::size_t n = 0;
        return detail::pairs<IndexPair>(sw_find_pairs(b.min, b.size, b.stride, b.max, get(), &n), n);
    }
    Result<Span<const IndexPair>> find_pairs(const Boxes &a, const Boxes &b) {
        std::size_t n = 0;
        return detail::pairs<IndexPair>(sw_find_pairs_between(
            a.min, a.size, a.stride, a.max, b.min, b.size, b.stride, b.max, get(), &n), n);
    }
    Done save() const { return done(sw_search_save(get())); }
    std::string describe() const { return detail::text(sw_search_describe, get()); }
};

} // namespace sapwise
#endif
