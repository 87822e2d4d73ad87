"""Words that C keeps for itself, and names of its mathematical library."""

_KEYWORDS = """
    auto break case char const continue default do double else enum extern float for goto if inline
    int long register restrict return short signed sizeof static struct switch typedef union
    unsigned void volatile while main
    alignas alignof and and_eq asm atomic bitand bitor bool catch class compl concept constexpr
    const_cast delete dynamic_cast explicit export false friend mutable namespace new noexcept not
    not_eq nullptr operator or or_eq private protected public reinterpret_cast requires
    static_assert static_cast template this thread_local throw true try typeid typename typeof
    using virtual wchar_t xor xor_eq NULL
"""

_MATHEMATICS = """
    acos acosh asin asinh atan atan2 atanh cbrt ceil copysign cos cosh erf erfc exp exp2 expm1 fabs
    fdim floor fma fmax fmin fmod frexp hypot ilogb ldexp lgamma llrint llround log log10 log1p log2
    logb lrint lround modf nan nearbyint nextafter nexttoward pow remainder remquo rint round
    scalbln scalbn sin sinh sqrt tan tanh tgamma trunc
"""

_OTHER_MATHEMATICS = """
    abs labs j0 j1 jn y0 y1 yn gamma signgam isfinite isinf isnan isnormal signbit fpclassify
    isgreater isgreaterequal isless islessequal islessgreater isunordered double_t float_t
    math_errhandling HUGE_VAL HUGE_VALF HUGE_VALL INFINITY NAN FP_INFINITE FP_NAN FP_NORMAL
    FP_SUBNORMAL FP_ZERO FP_FAST_FMA FP_FAST_FMAF FP_FAST_FMAL FP_ILOGB0 FP_ILOGBNAN MATH_ERRNO
    MATH_ERREXCEPT M_E M_PI M_PI_2 M_PI_4 M_SQRT2 M_SQRT1_2 M_LN2 M_LN10 M_LOG2E M_LOG10E M_1_PI
    M_2_PI M_2_SQRTPI linux unix i386
"""

#: Identifiers that generated C does not use for anything of its own.
C_WORDS: frozenset[str] = frozenset(
    [
        *_KEYWORDS.split(),
        *(name + suffix for name in _MATHEMATICS.split() for suffix in ("", "f", "l")),
        *_OTHER_MATHEMATICS.split(),
    ]
)
