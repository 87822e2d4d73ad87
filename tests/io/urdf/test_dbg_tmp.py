import sys, pathlib, numpy as np, robostiff as rs
def test_x(tmp_path):
    from tests.io.urdf.test_side_files import ARM, STIFF
    p=tmp_path
    import robostiff.kinematics.closure; L=sys.modules["robostiff.kinematics.closure.leg_solver"]
    old=L._check_home
    def new(leg,q,home,length):
        print("Q",q, home, length, L._gap_at_home(leg,q,home,length), L._CLOSED); return old(leg,q,home,length)
    L._check_home=new
    for i in (0,1):
        (p/'arm.urdf').write_text(ARM if i==0 else ARM.replace('"shoulder" type="continuous"', '"shoulder" type="planar"'))
        (p/'arm.stiffness.yaml').write_text(STIFF.replace('joints: {"*"', 'joints: {shoulder: {role: passive}, "*"'))
        r=rs.load(p/'arm.urdf')
