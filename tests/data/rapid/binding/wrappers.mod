MODULE m
  CONST robtarget p1:=[[1,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p2:=[[2,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pOwn:=[[9,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    mvFixed p1;
    mvTwice 5,p2\Stop,tGun\WObj:=wTable;
    mvTwice 5,p2,tGun;
    mvBoth p1,tGun\Obj:=wTable;
    mvBoth p1,tGun;
    mvAbove p1,tGun\WObj:=wTable;
    mvChanged p1;
    weldHere p2,sd_wp432810;
    mvNamed t:=tGun,p:=p1;
    goHome tGun;
  ENDPROC
  PROC mvFixed(robtarget p)
    MoveJ p,v100,fine,tGun\WObj:=wTable;
  ENDPROC
  PROC mvTwice(num n,robtarget p,\switch Stop,PERS tooldata t\PERS wobjdata WObj)
    mvOnce p,t\WObj?WObj;
  ENDPROC
  PROC mvOnce(robtarget p,PERS tooldata t\PERS wobjdata WObj)
    MoveL p,v100,fine,t\WObj?WObj;
  ENDPROC
  PROC mvBoth(robtarget p,PERS tooldata t\PERS wobjdata Obj)
    IF Present(Obj) THEN
      MoveL p,v100,fine,t\WObj:=Obj;
    ELSE
      MoveL p,v100,fine,t\WObj:=wFloor;
    ENDIF
  ENDPROC
  PROC mvAbove(robtarget p,PERS tooldata t\PERS wobjdata WObj)
    MoveL Offs(p,0,0,300),v100,z10,t\WObj?WObj;
  ENDPROC
  PROC mvChanged(robtarget p)
    p.trans.z:=p.trans.z+100;
    MoveL p,v100,fine,tGun\WObj:=wTable;
  ENDPROC
  PROC weldHere(robtarget p,spotdata s)
    MoveL RelTool(p,0,0,-20),v100,z10,tGun\WObj:=wTable;
    SpotL p,v100,gun1,s,tGun\WObj:=wTable;
  ENDPROC
  PROC mvNamed(robtarget p,PERS tooldata t)
    MoveL p,v100,fine,t\WObj:=wTable;
  ENDPROC
  PROC goHome(PERS tooldata t)
    MoveJ pOwn,v100,fine,t\WObj:=wTable;
  ENDPROC
  PROC itself(robtarget p)
    MoveL p,v100,fine,tGun;
    itself p;
  ENDPROC
ENDMODULE
