MODULE MotionForms
  PROC main()
    MoveL\Conc,p1,v100,z10,tGun;
    MoveC p1,p2\ID:=1,v100,z10,tGun\WObj:=w;
    MoveAbsJ jHome\ID:=2\NoEOffs,v100,fine,tool0\WObj:=wobj0\TLoad:=l;
    MoveExtJ jExt,vrot50,fine;
    MoveLDO p1,v100,z10,tGun\WObj:=w,do1,1;
    MoveLSync p1,v100,z10,tGun\WObj:=w,"proc";
    SearchL\PStop,di1\PosFlank,sp,p1,v10,tGun\WObj:=w;
    TriggL p1,v100,trigg1\T2:=trigg2,z10,tGun;
    ArcL p1,v100,seam1,weld1\Weave:=weave1,z1,tGun\WObj:=w;
    MoveL targets{i}.position,speed{n},zones{1,2},tools{t}.tool\WObj:=w.obj;
    tGun.tframe.trans.z:=tGun.tframe.trans.z+0.1;
    matrix{i,j+1}.x:=Offs(p1,0,0,10*(i-1));
    PDispSet pDisp;
    PDispOn\Rot,p1,tGun\WObj:=w;
    CONNECT int1 WITH tTrap;
    CONNECT ints{2} WITH tTrap;
  ENDPROC
ENDMODULE
