%%%
  VERSION:1
  LANGUAGE:ENGLISH
%%%

MODULE TipDress
  ! Kappenfräser am Sockel rechts vom Roboter
  CONST robtarget pDress10:=[[262.5,9.5,151],[0.011075278,-0.102906486,-0.009159788,0.994587197],[0,-1,0,1],[130,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pDress20:=[[124,0.5,12],[0.011075278,-0.102906486,-0.009159788,0.994587197],[0,-1,0,1],[100,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pDress30:=[[0.4,-0.3,11.9],[0.011075278,-0.102906486,-0.009159788,0.994587197],[0,-1,0,1],[22,9E+09,9E+09,9E+09,9E+09,9E+09]];

  PROC rTipDress(num nMode)
    VAR num nCuts;
    MoveJ pDress10,v1500,z50,tWeldGun1\WObj:=wobjTipDress;
    MoveL pDress20,v500,z10,tWeldGun1\WObj:=wobjTipDress;
    SetDO doDresserOn,1;
    WaitDI diDresserSpeed,1;
    MoveL pDress30,v100,fine,tWeldGun1\WObj:=wobjTipDress;
    FOR i FROM 1 TO nMode DO
      PulseDO\PLength:=1.2,doDresserFeed;
      WaitTime 1.5;
      nCuts:=nCuts+1;
    ENDFOR
    MoveL pDress20,v500,z10,tWeldGun1\WObj:=wobjTipDress;
    SetDO doDresserOn,0;
    nSpotsSinceDress:=0;
    MoveJ pDress10,v1500,z50,tWeldGun1\WObj:=wobjTipDress;
  ENDPROC
ENDMODULE
